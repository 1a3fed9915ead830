// `lodestone check` finds each fault and reports nothing else: faults of the simulator, and mistakes in platform file,
// maps and initial pose, on a drive of eight seconds.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "core/error.h"
#include "tests/tools/check/check_site.h"
#include "tools/commands.h"

namespace lodestone {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::UnorderedElementsAre;

/// The kinds of all warnings and errors.
std::vector<std::string> alarms(const CheckCall& call) {
  std::vector<std::string> kinds;
  for (const Finding& finding : check_log(call).findings) {
    if (finding.severity == Severity::note) continue;
    kinds.push_back(finding.kind);
    std::printf("  %s: %s -> %s\n", finding.kind.c_str(), finding.seen.c_str(), finding.change.c_str());
  }
  return kinds;
}

const Finding* find(const CheckResult& result, const std::string& kind) {
  for (const Finding& finding : result.findings) {
    if (finding.kind == kind) return &finding;
  }
  return nullptr;
}

TEST(CheckFaults, ACleanLogRaisesNoAlarm) {
  EXPECT_THAT(alarms(site().call()), IsEmpty());
  CheckCall alone = site().call();
  alone.cloud = alone.magnetic = alone.initial_pose_from = "";
  EXPECT_THAT(alarms(alone), IsEmpty());
}

TEST(CheckFaults, CalibrationOfSingleMagnetometers) {
  EXPECT_THAT(
      alarms(site().call("{kind: hard_iron, magnetometer: front_0, offset_ut: [12, -5, 8]}, "
                         "{kind: soft_iron, magnetometer: front_2, scale: [1.2, 0.85, 1.0], shear: [0.05, 0, 0]}, "
                         "{kind: misalignment, magnetometer: rear_1, rotation_rpy_deg: [0, 0, 20]}")),
      UnorderedElementsAre("magnetometer.offset", "magnetometer.stretched", "magnetometer.turned"));
}

TEST(CheckFaults, HealthOfSingleMagnetometers) {
  EXPECT_THAT(alarms(site().call("{kind: bias_drift, magnetometer: front_0, rate_ut_s: [1.5, 0, -2]}, "
                                 "{kind: stuck, magnetometer: front_2, begin_s: 3}, "
                                 "{kind: saturated, magnetometer: rear_0, limit_ut: 30}, "
                                 "{kind: spikes, magnetometer: rear_1, rate_per_s: 2, size_ut: 50}, "
                                 "{kind: dead, magnetometer: rear_3, begin_s: 4}")),
              UnorderedElementsAre("magnetometer.drift", "magnetometer.stuck", "magnetometer.limit",
                                   "magnetometer.spike", "magnetometer.silent"));
}

TEST(CheckFaults, AnArrayWithoutMountingsIsNotBlamedOnItsSensors) {
  const CheckCall call = site().call_with([](Platform& platform) {
    // As `lodestone init` writes it from a log without /tf_static.
    for (std::size_t i = 0; i < platform.suite.magnetometers.size(); ++i) {
      platform.suite.magnetometers[i].T_imu_mag = Pose{};
      platform.guesses.push_back("magnetometers[" + std::to_string(i) + "].T_imu_mag");
    }
  });
  EXPECT_THAT(alarms(call), Not(Contains("magnetometer.drift")));
  EXPECT_THAT(alarms(call), Contains("platform.guesses"));
}

TEST(CheckFaults, ExchangedMagnetometers) {
  const auto exchange = [](std::vector<std::size_t> ring) {
    return site().call_with([ring](Platform& platform) {
      for (std::size_t i = 1; i < ring.size(); ++i)
        std::swap(platform.magnetometers[ring[0]].topic, platform.magnetometers[ring[i]].topic);
    });
  };
  // Neighbours of one row; front and rear, which face opposite directions; three in a ring.
  for (const std::vector<std::size_t>& ring : {std::vector<std::size_t>{0, 2}, {1, 6}, {0, 3, 5}}) {
    EXPECT_THAT(alarms(exchange(ring)), UnorderedElementsAre("magnetometer.exchanged"));
  }
  const CheckResult result = check_log(exchange({0, 6}));
  const Finding* finding = find(result, "magnetometer.exchanged");
  ASSERT_NE(finding, nullptr);
  EXPECT_THAT(finding->change, AllOf(HasSubstr("magnetometers[0].topic: /magnetometer_0/field"),
                                     HasSubstr("magnetometers[6].topic: /magnetometer_6/field")));
}

TEST(CheckFaults, ADeadMagnetometerHasNoTopic) {
  EXPECT_THAT(alarms(site().call("{kind: dead, magnetometer: front_1}")), UnorderedElementsAre("topic.missing"));
}

TEST(CheckFaults, GapsAndOneLateMagnetometer) {
  EXPECT_THAT(
      alarms(site().call("{kind: lidar_outage, begin_s: 3, end_s: 3.6}, {kind: imu_gap, begin_s: 6, end_s: 6.1}, "
                         "{kind: lidar_outage, begin_s: 4, end_s: 4.3, scans: empty}, "
                         "{kind: clock_offset, sensor: rear_2, offset_s: -0.2}")),
      UnorderedElementsAre("lidar.outage", "imu.gap", "lidar.empty", "clock.magnetometer"));
}

TEST(CheckFaults, StepsOfTheImusBiases) {
  EXPECT_THAT(alarms(site().call("{kind: imu_bias_jump, at_s: 4.5, gyroscope_rad_s: [0.02, -0.02, 0.03], "
                                 "accelerometer_m_s2: [0.3, -0.3, 0.2]}")),
              UnorderedElementsAre("imu.gyroscope_step", "imu.accelerometer_step"));
}

TEST(CheckFaults, ClocksOfLidarAndImu) {
  for (const auto& [fault, offset_s] : {std::pair{"{kind: clock_offset, sensor: imu, offset_s: 0.05}", 0.05},
                                        std::pair{"{kind: clock_offset, sensor: lidar, offset_s: 0.3}", -0.3}}) {
    const CheckResult result = check_log(site().call(fault));
    const Finding* clock = find(result, "clock.lidar_imu");
    ASSERT_NE(clock, nullptr) << fault;
    EXPECT_EQ(clock->severity, Severity::warning) << fault;
    double found_s = 0.0;
    ASSERT_EQ(std::sscanf(clock->seen.c_str(), "the IMU's stamps are %lf s", &found_s), 1) << clock->seen;
    EXPECT_NEAR(found_s, std::abs(offset_s), 0.01);
    EXPECT_THAT(clock->seen, HasSubstr(offset_s > 0.0 ? "later" : "earlier"));
    double stated_s = 0.0;
    const std::size_t at = clock->change.find("lidar.clock_offset_s: ");
    ASSERT_NE(at, std::string::npos) << clock->change;
    ASSERT_EQ(std::sscanf(clock->change.c_str() + at, "lidar.clock_offset_s: %lf", &stated_s), 1);
    EXPECT_NEAR(stated_s, -offset_s, 0.01);
  }
}

TEST(CheckFaults, AClockOffsetThatIsStatedAsAdvisedIsNoFault) {
  CheckCall call = site().call_with([](Platform& platform) {
    platform.lidar.clock_offset_s = -0.05;
    platform.magnetometer_clock_offset_s = -0.05;
  });
  call.log = site().log("{kind: clock_offset, sensor: imu, offset_s: 0.05}");
  EXPECT_THAT(alarms(call), ::testing::IsEmpty());
}

TEST(CheckFaults, ClocksOfMagnetometers) {
  const CheckCall call = site().call("{kind: clock_offset, sensor: magnetometers, offset_s: 0.05}");
  EXPECT_THAT(alarms(call), UnorderedElementsAre("clock.magnetometers"));
  double stated_s = 0.0;
  const std::string change = find(check_log(call), "clock.magnetometers")->change;
  const std::size_t at = change.find("magnetometer_clock_offset_s: ");
  ASSERT_NE(at, std::string::npos) << change;
  ASSERT_EQ(std::sscanf(change.c_str() + at, "magnetometer_clock_offset_s: %lf", &stated_s), 1);
  EXPECT_NEAR(stated_s, 0.05, 0.01 + 1e-9);  // one step of the search
}

TEST(CheckFaults, SteelThatPasses) {
  EXPECT_THAT(
      alarms(site().call("{kind: passing_steel, begin_s: 3, end_s: 8, from_m: [4, -1.7, 0.4], to_m: [-4, -1.7, 0.4], "
                         "moment_a_m2: [0, 100, 280]}")),
      UnorderedElementsAre("field.passing"));
}

TEST(CheckFaults, WrongLinesOfThePlatformFile) {
  const auto at_begin = [](const std::function<void(Platform&)>& edit) {
    CheckCall call = site().call_with(edit);
    call.seconds = 2.0;
    return alarms(call);
  };
  const auto invert = [](Platform& platform) {
    platform.suite.lidar.T_imu_lidar = platform.suite.lidar.T_imu_lidar.inverse();
  };
  EXPECT_THAT(at_begin(invert), UnorderedElementsAre("extrinsic.inverse"));
  EXPECT_THAT(at_begin([](Platform& platform) { platform.magnetometers[2].unit = FieldUnit::microtesla; }),
              UnorderedElementsAre("magnetometer.unit"));
  EXPECT_THAT(at_begin([](Platform& platform) { platform.imu.acceleration_unit = AccelerationUnit::standard_gravity; }),
              UnorderedElementsAre("imu.acceleration_unit"));
  for (const ScanStamp stamp : {ScanStamp::middle, ScanStamp::end}) {
    const CheckCall call = site().call_with([stamp](Platform& platform) { platform.lidar.stamp = stamp; });
    EXPECT_THAT(alarms(call), UnorderedElementsAre("clock.lidar_imu"));
    EXPECT_THAT(find(check_log(call), "clock.lidar_imu")->change, HasSubstr("lidar.stamp: start"));
  }
  const auto two_lines = [](Platform& platform) {
    platform.suite.imu.rate_hz = 100.0;
    platform.suite.magnetometers[5].T_imu_mag.rotation.setIdentity();  // it faces backwards
  };
  EXPECT_THAT(alarms(site().call_with(two_lines)), UnorderedElementsAre("imu.rate", "magnetometer.turned"));
}

TEST(CheckFaults, LinesOfThePlatformFileThatAreSuggested) {
  const auto change_of = [](CheckCall call, const std::string& kind) {
    call.seconds = 1.0;
    const CheckResult result = check_log(call);
    const Finding* finding = find(result, kind);
    return finding == nullptr ? "no such finding: " + kind : finding->change;
  };
  EXPECT_THAT(change_of(site().call_with([](Platform& platform) { platform.imu.topic = "/imu/dat"; }), "topic.missing"),
              HasSubstr("imu.topic: /imu/data"));
  EXPECT_THAT(
      change_of(site().call_with([](Platform& platform) { platform.lidar.time_unit = PointTimeUnit::microseconds; }),
                "lidar.point_time"),
      HasSubstr("lidar.time_unit: ns"));
  EXPECT_THAT(
      change_of(site().call_with([](Platform& platform) { platform.lidar.time_field = "ring"; }), "lidar.point_time"),
      HasSubstr("lidar.fields.time: t, lidar.time_unit: ns"));
}

TEST(CheckFaults, ATurnedLidarIsToldWithoutAMap) {
  const auto alone = [](CheckCall call) {
    call.cloud = call.magnetic = call.initial_pose_from = "";
    return alarms(call);
  };
  const auto turn = [](const Quaternion& by) {
    return [by](Platform& platform) {
      Quaternion& rotation = platform.suite.lidar.T_imu_lidar.rotation;
      rotation = rotation * by;
    };
  };
  const double quarter = 1.5707963267948966;
  EXPECT_THAT(alone(site().call_with(turn(so3::exp(Vector3(quarter, 0, 0))))), Contains("extrinsic.rotation"));
  EXPECT_THAT(alone(site().call_with(turn(so3::exp(Vector3(0, 0, 2 * quarter))))),
              UnorderedElementsAre("extrinsic.heading"));

  // The same messages as those of a second LiDAR: first correct, then with a rolled mounting.
  const auto second = [&](double roll) {
    return site().call_with([roll](Platform& platform) {
      platform.further_lidars = {platform.lidar};
      platform.suite.further_lidars = {platform.suite.lidar};
      Quaternion& rotation = platform.suite.further_lidars[0].T_imu_lidar.rotation;
      rotation = rotation * so3::exp(Vector3(roll, 0, 0));
    });
  };
  EXPECT_THAT(alone(second(0.0)), IsEmpty());
  CheckCall rolled = second(quarter);
  rolled.cloud = rolled.magnetic = rolled.initial_pose_from = "";
  const CheckResult result = check_log(rolled);
  const Finding* finding = find(result, "extrinsic.rotation");
  ASSERT_NE(finding, nullptr);
  EXPECT_THAT(finding->change, HasSubstr("correct further_lidars[0].T_imu_lidar"));
}

TEST(CheckFaults, AWrongStartOrMap) {
  CheckCall elsewhere = site().call();
  elsewhere.initial_pose_from = "";
  elsewhere.initial_pose = "3 2 0.2 0 0 0 1";
  elsewhere.seconds = 2.0;
  EXPECT_THAT(alarms(elsewhere), UnorderedElementsAre("start.wrong"));
  const auto with_cloud = [](const char* name, const std::function<Vector3(const Vector3&)>& move) {
    std::vector<Eigen::Vector3f> points;
    for (const Eigen::Vector3f& point : site().cloud()) points.push_back(move(point.cast<double>()).cast<float>());
    write_point_cloud(site().file(name), points);
    CheckCall call = site().call();
    call.cloud = site().file(name);
    call.seconds = 2.0;
    return alarms(call);
  };
  const Quaternion tilt = so3::exp(Vector3(0.0, 0.09, 0.0));
  EXPECT_THAT(with_cloud("tilted.pcd", [&](const Vector3& point) -> Vector3 { return tilt * point; }),
              Contains("start.tilt"));
  EXPECT_THAT(with_cloud("shifted.pcd", [](const Vector3& point) -> Vector3 { return point + Vector3(0.6, 0, 0); }),
              UnorderedElementsAre("start.off"));
  EXPECT_THAT(with_cloud("millimetres.pcd", [](const Vector3& point) -> Vector3 { return 1000.0 * point; }),
              UnorderedElementsAre("map.no_planes"));
}

TEST(CheckCommand, ExitCodesAndReport) {
  const std::string log = site().log("");
  EXPECT_EQ(run_lodestone("check " + log).code, exit_code::done);
  const std::string json = site().file("check.json");
  const ProgramResult good =
      run_lodestone("check " + log + " --seconds 3 --platform " + site().file("platform.yaml") + " --out " + json);
  EXPECT_EQ(good.code, exit_code::done) << good.output << good.errors;
  EXPECT_THAT(good.output, HasSubstr("0 errors, 0 warnings"));
  const auto report = nlohmann::json::parse(content_of(json));
  EXPECT_EQ(report["topics"].size(), 10U);
  EXPECT_NEAR(report["checked_s"].get<double>(), 3.0, 1e-9);

  // The path of --out is checked before the log; a missing folder is created.
  EXPECT_EQ(run_lodestone("check " + log + " --seconds 1 --out " + site().file("new/check.json")).code,
            exit_code::done);
  EXPECT_EQ(nlohmann::json::parse(content_of(site().file("new/check.json")))["topics"].size(), 10U);
  const ProgramResult early = run_lodestone("check " + log + " --seconds 1 --out " + log + "/check.json");
  EXPECT_EQ(early.code, exit_code::input_error);
  EXPECT_EQ(early.output, "");
  EXPECT_THAT(early.errors, HasSubstr("is not a folder; choose another --out"));

  const CheckCall wrong = site().call_with([](Platform& platform) { platform.imu.topic = "/imu"; });
  const ProgramResult bad = run_lodestone("check " + log + " --seconds 3 --platform " + wrong.platform);
  EXPECT_EQ(bad.code, exit_code::input_error);
  EXPECT_EQ(std::count(bad.errors.begin(), bad.errors.end(), '\n'), 1) << bad.errors;
  EXPECT_THAT(bad.output, HasSubstr("imu.topic: /imu/data"));

  expect_refused("check " + site().file("no.bag"), "no such log");
  expect_refused("check " + log + " --seconds 0", "--seconds");
  expect_refused("check " + log + " --cloud " + site().file("cloud.pcd"), "requires --platform");
}

}  // namespace
}  // namespace lodestone

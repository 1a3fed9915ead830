// Checks of `lodestone run` on the first seconds of a log.
#include "tools/run/first_seconds.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "core/error.h"
#include "estimators/factory.h"
#include "frontends/maps/plane_map_loader.h"
#include "localization/initial_pose.h"
#include "tests/frontends/logs/test_files.h"
#include "tests/tools/check/check_site.h"
#include "tools/commands.h"

namespace lodestone {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::message_of;

/// A call with the map and the true initial pose; the pose is moved by `offset_m` in the map and then by `T_start`.
struct Begin {
  Platform platform = site().platform();
  std::string log = site().log("");
  Vector3 offset_m = Vector3::Zero();
  Pose T_start;

  std::vector<std::string> warnings() const {
    WarningLog counted;
    const Trajectory truth = read_trajectory(site().file("truth.tum"));
    const auto start_at = [&](Time time) -> std::optional<Pose> {
      Pose start = initial_pose_from(truth, "truth", time);
      start.position += offset_m;
      return start * T_start;
    };
    static const std::shared_ptr<const PlaneMapSource> planes =
        load_planes(site().file("cloud.pcd"), RunOptions{}.lidar.map, platform.suite.lidars(), site().file(""), counted)
            .source;
    check_first_seconds({log, platform, {}, 5.0, planes, start_at}, counted);
    std::vector<std::string> kinds;
    for (const auto& [kind, entry] : counted.entries()) kinds.push_back(kind + ": " + entry.first_detail);
    return kinds;
  }
  std::string error() const {
    return message_of<InputError>([this] { warnings(); });
  }
};

TEST(CheckFirstSeconds, SayNothingOfACleanLog) {
  EXPECT_THAT(Begin{}.warnings(), IsEmpty());
}

TEST(CheckFirstSeconds, RefuseWhatMakesARunWrong) {
  Begin inverted;
  inverted.platform.suite.lidar.T_imu_lidar = inverted.platform.suite.lidar.T_imu_lidar.inverse();
  EXPECT_THAT(inverted.error(), AllOf(HasSubstr("log0.bag: extrinsic.inverse: "),
                                      HasSubstr("invert lidar.T_imu_lidar in "), HasSubstr("--check-seconds 0")));
  Begin silent;
  silent.platform.imu.topic = "/imu";
  EXPECT_THAT(silent.error(), AllOf(HasSubstr("there is no topic /imu"), Not(HasSubstr("--check-seconds"))))
      << "the reader refuses it whatever is checked";
}

/// The scan fits the map with T_imu_lidar and with its inverse. Only the initial pose decides between them.
TEST(CheckFirstSeconds, AnInverseIsToldByTheStart) {
  Begin begin;
  Pose& T_imu_lidar = begin.platform.suite.lidar.T_imu_lidar;
  const Pose inverse{Quaternion::Identity(), Vector3(-0.3, 0.0, 0.0)};
  begin.T_start = T_imu_lidar * inverse;  // the true extrinsics are then the inverse of `inverse`
  T_imu_lidar = inverse;
  EXPECT_THAT(begin.warnings(),
              ElementsAre(AllOf(HasSubstr("check.extrinsic.inverse: the scan fits 0.60 m"),
                                HasSubstr("invert lidar.T_imu_lidar in "), HasSubstr("--initial-pose \""))));
  T_imu_lidar = inverse.inverse();
  EXPECT_THAT(begin.warnings(), IsEmpty());
}

TEST(CheckFirstSeconds, WarnOfWhatARunSurvives) {
  Begin begin;
  begin.platform.suite.imu.rate_hz = 100.0;
  begin.offset_m = Vector3(0.5, 0.0, 0.0);
  EXPECT_THAT(begin.warnings(), ElementsAre(AllOf(HasSubstr("check.imu.rate: "), HasSubstr("imu.rate_hz: 200.0 in ")),
                                            AllOf(HasSubstr("check.start.off: "), HasSubstr("--initial-pose \""))));
  Begin faulty;
  faulty.log = site().log("{kind: dead, magnetometer: rear_3, begin_s: 4}, {kind: imu_gap, begin_s: 2, end_s: 2.1}");
  EXPECT_THAT(faulty.warnings(), ElementsAre(HasSubstr("check.magnetometer.silent: ")))
      << "gaps of the IMU are counted by the run itself";
}

TEST(CheckCommand, ARunKeepsItsBitsAndListsWhatWasSeen) {
  const CheckCall call = site().call_with([](Platform& platform) { platform.suite.imu.rate_hz = 160.0; });
  const auto run = [&](const std::string& name, const std::string& options) {
    return run_lodestone("run " + call.log + " --platform " + call.platform + " --cloud " + call.cloud +
                         " --initial-pose-from " + call.initial_pose_from + " --out " + site().file(name) + " " +
                         options);
  };
  const ProgramResult checked = run("checked", "");
  ASSERT_EQ(checked.code, exit_code::done) << checked.errors;
  EXPECT_THAT(checked.output, HasSubstr("check.imu.rate"));
  const auto summary = nlohmann::json::parse(content_of(site().file("checked/summary.json")));
  EXPECT_TRUE(summary.dump().find("check.imu.rate") != std::string::npos);
  const ProgramResult unchecked = run("unchecked", "--check-seconds 0");
  ASSERT_EQ(unchecked.code, exit_code::done) << unchecked.errors;
  EXPECT_THAT(unchecked.output, Not(HasSubstr("check.")));
  EXPECT_EQ(content_of(site().file("checked/smoother/trajectory.tum")),
            content_of(site().file("unchecked/smoother/trajectory.tum")));
  expect_refused("run " + call.log + " --platform " + call.platform + " --cloud " + call.cloud + " --out " +
                     site().file("refused") + " --check-seconds -1",
                 "--check-seconds");
}

}  // namespace
}  // namespace lodestone

// Checks of a log without maps, on a robot at rest with one defect per test.
#include "tools/check/log_checks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "tests/frontends/logs/synthetic_log.h"
#include "tests/frontends/logs/test_files.h"

namespace lodestone {
namespace {

using ::testing::HasSubstr;
using testing::SyntheticLog;
using ::testing::UnorderedElementsAre;

class LogChecks : public ::testing::Test {
 protected:
  Findings check(const SyntheticLog& log, const Platform& platform) {
    log.write(folder_ / "log.bag");
    WarningLog warnings;
    const LogSample sample = read_log_sample(folder_ / "log.bag", platform, 30.0, warnings);
    return check_sensors(sample, platform);
  }

  std::vector<std::string> alarms(const SyntheticLog& log, const Platform& platform) {
    std::vector<std::string> kinds;
    for (const Finding& finding : check(log, platform)) {
      if (finding.severity != Severity::note) kinds.push_back(finding.kind);
    }
    return kinds;
  }

  /// A healthy robot: it sees a wall. Its field is noisy, because a constant field counts as stuck.
  static SyntheticLog healthy() {
    SyntheticLog log;
    log.on_scan = [](int, ros1::PointCloudMessage&, std::vector<std::uint8_t>& data) {
      for (std::size_t i = 0; i * SyntheticLog::point_step < data.size(); ++i) {
        const float along = 0.01F * static_cast<float>(i) - 10.0F;
        std::memcpy(data.data() + i * SyntheticLog::point_step + 4, &along, 4);
      }
      return true;
    };
    log.on_field = [](int i, int k, ros1::MagneticFieldMessage& field) {
      for (int axis = 0; axis < 3; ++axis)
        field.field_tesla[static_cast<std::size_t>(axis)] += 1e-6 * std::sin(12.9898 * i + 78.2 * axis + k);
      return true;
    };
    return log;
  }
  static SyntheticLog with_imu(const std::function<bool(int, ros1::ImuMessage&)>& change) {
    SyntheticLog log = healthy();
    log.on_imu = [change](int i, ros1::ImuMessage& imu) {
      imu.angular_velocity[2] = 0.0;
      return change(i, imu);
    };
    return log;
  }
  static SyntheticLog still() {
    return with_imu([](int, ros1::ImuMessage&) { return true; });
  }

  testing::TemporaryFolder folder_;
};

TEST_F(LogChecks, AHealthyLogRaisesNoAlarm) {
  EXPECT_THAT(alarms(still(), still().platform()), UnorderedElementsAre());
}

TEST_F(LogChecks, ARobotWithoutLidarIsNotAskedForOne) {
  Platform platform = still().platform();
  platform.lidar.topic.clear();
  for (const Finding& finding : check(still(), platform)) EXPECT_NE(finding.kind, "topic.missing") << finding.seen;
}

TEST_F(LogChecks, AWrongTopicNamesTheOneThatFits) {
  Platform platform = still().platform();
  platform.lidar.topic = "/points";
  platform.magnetometers[1].topic = "/magnetometer_7/field";
  const Findings findings = check(still(), platform);
  ASSERT_GE(findings.size(), 2U);
  EXPECT_EQ(findings[0].kind, "topic.missing");
  EXPECT_THAT(findings[0].change, HasSubstr("lidar.topic: /ouster/points"));
  EXPECT_THAT(findings[1].change, HasSubstr("magnetometers[1].topic: /magnetometer_1/field"));
}

TEST_F(LogChecks, MountingsThatNobodyMeasured) {
  Platform platform = still().platform();
  platform.suite.magnetometers[1].T_imu_mag.position = platform.suite.magnetometers[0].T_imu_mag.position;
  EXPECT_THAT(alarms(still(), platform), UnorderedElementsAre("magnetometer.same_place"));
  platform.guesses = {"lidar.T_imu_lidar", "magnetometers[1].T_imu_mag"};
  EXPECT_THAT(alarms(still(), platform), UnorderedElementsAre("platform.guesses"));
}

TEST_F(LogChecks, StampsThatAreNone) {
  EXPECT_THAT(alarms(with_imu([](int, ros1::ImuMessage& imu) {
                       imu.stamp = 0;
                       return true;
                     }),
                     still().platform()),
              UnorderedElementsAre("imu.stamp_zero"));
  EXPECT_THAT(alarms(with_imu([](int i, ros1::ImuMessage& imu) {
                       if (i == 100) imu.stamp -= 50'000'000;
                       return true;
                     }),
                     still().platform()),
              UnorderedElementsAre("imu.stamp_order"));
  EXPECT_THAT(alarms(with_imu([](int, ros1::ImuMessage& imu) {
                       imu.stamp -= 1'000'000'000'000;
                       return true;
                     }),
                     still().platform()),
              ::testing::Contains("clock.foreign"));
}

TEST_F(LogChecks, UnitsOfTheImu) {
  EXPECT_THAT(alarms(with_imu([](int, ros1::ImuMessage& imu) {
                       imu.linear_acceleration[2] = 1.0;
                       return true;
                     }),
                     still().platform()),
              UnorderedElementsAre("imu.acceleration_unit"));
  // Noise of a tenth of a degree per second, bias of 0.2 °/s: in degrees, the numbers are 57 times as large.
  const auto in_degrees = [&](double bias) {
    return alarms(with_imu([bias](int i, ros1::ImuMessage& imu) {
                    for (std::size_t axis = 0; axis < 3; ++axis)
                      imu.angular_velocity[axis] = 57.3 * (0.02 * std::sin(91.7 * i) + bias);
                    return true;
                  }),
                  still().platform());
  };
  EXPECT_THAT(in_degrees(0.004), UnorderedElementsAre("imu.gyroscope_unit"));
  EXPECT_THAT(in_degrees(0.0), UnorderedElementsAre("imu.gyroscope_noise")) << "a guess alone";
  EXPECT_THAT(alarms(with_imu([](int, ros1::ImuMessage& imu) {
                       imu.linear_acceleration[0] = std::numeric_limits<double>::quiet_NaN();
                       return true;
                     }),
                     still().platform()),
              UnorderedElementsAre("imu.not_finite"));
}

TEST_F(LogChecks, TimesOfPoints) {
  const auto with_times = [](const std::function<std::uint32_t(std::uint32_t)>& change) {
    SyntheticLog log = still();
    log.on_scan = [change](int, ros1::PointCloudMessage&, std::vector<std::uint8_t>& data) {
      for (std::size_t i = 0; i * SyntheticLog::point_step < data.size(); ++i) {
        std::uint32_t time = 0;
        std::memcpy(&time, data.data() + i * SyntheticLog::point_step + 20, 4);
        time = change(time);
        std::memcpy(data.data() + i * SyntheticLog::point_step + 20, &time, 4);
      }
      return true;
    };
    return log;
  };
  const Platform platform = still().platform();
  EXPECT_THAT(alarms(with_times([](std::uint32_t) { return 0U; }), platform), UnorderedElementsAre("lidar.point_time"));
  const Findings at_once = check(with_times([](std::uint32_t) { return 0U; }), platform);
  ASSERT_FALSE(at_once.empty());
  EXPECT_THAT(at_once[0].change, HasSubstr("lidar.point_times: none"));
  Platform deskewed = platform;
  deskewed.lidar.point_times = PointTimes::none;
  SyntheticLog of_one_time = still();
  of_one_time.on_scan = [wall = still().on_scan](int i, ros1::PointCloudMessage& cloud,
                                                 std::vector<std::uint8_t>& data) {
    for (std::size_t at = 20; at < data.size(); at += SyntheticLog::point_step) std::memset(data.data() + at, 0, 4);
    return wall(i, cloud, data);
  };
  EXPECT_THAT(alarms(of_one_time, platform), UnorderedElementsAre("lidar.point_time"));
  EXPECT_THAT(alarms(of_one_time, deskewed), UnorderedElementsAre());
  const Findings other_unit = check(with_times([](std::uint32_t time) { return time / 1000U; }), platform);
  ASSERT_FALSE(other_unit.empty());
  EXPECT_EQ(other_unit[0].kind, "lidar.point_time");
  EXPECT_THAT(other_unit[0].change, HasSubstr("lidar.fields.time: t, lidar.time_unit: us"));
  Platform wrong_field = platform;
  wrong_field.lidar.time_field = "time";
  const Findings absent = check(still(), wrong_field);
  ASSERT_FALSE(absent.empty());
  EXPECT_EQ(absent[0].kind, "lidar.point_time");
  EXPECT_THAT(absent[0].change, HasSubstr("lidar.fields.time: t, lidar.time_unit: ns"));
}

TEST_F(LogChecks, MagnetometersThatReadNothingOrTheSame) {
  SyntheticLog log = still();
  log.on_field = [noisy = healthy().on_field](int i, int k, ros1::MagneticFieldMessage& field) {
    if (k == 0) field.field_tesla = {0.0, 0.0, 0.0};
    return k == 0 || noisy(i, k, field);
  };
  EXPECT_THAT(alarms(log, log.platform()), UnorderedElementsAre("magnetometer.zero"));
  log.on_field = [noisy = healthy().on_field](int i, int k, ros1::MagneticFieldMessage& field) {
    return k == 0 || noisy(i, k, field);
  };
  EXPECT_THAT(alarms(log, log.platform()), UnorderedElementsAre("magnetometer.stuck"));
}

}  // namespace
}  // namespace lodestone

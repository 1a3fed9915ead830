#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tools/check/sensor_checks.h"

namespace lodestone {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

struct WheelDefect {
  double factor = 1.0;  ///< of the reported velocity
  double late_s = 0.0;  ///< of the stamps
};

double velocity_at(double seconds) {
  return 1.5 - 1.5 * std::cos(0.5 * seconds);
}

double yaw_rate_at(double seconds) {
  return 0.5 * std::sin(0.8 * seconds) + 0.2 * std::sin(2.3 * seconds);
}

/// A drive of 20 s on a slope, which accelerates, brakes and turns.
LogSample drive_of(const WheelDefect& defect) {
  LogSample sample;
  for (int i = 0; i <= 4000; ++i) {
    const double seconds = i / 200.0;
    const Vector3 force(0.75 * std::sin(0.5 * seconds) + 0.3, yaw_rate_at(seconds) * velocity_at(seconds), 9.8);
    sample.imu.push_back({from_seconds(seconds), {0.0, 0.0, yaw_rate_at(seconds) + 0.01}, force});
  }
  for (int i = 0; i <= 400; ++i) {
    const double seconds = i / 20.0;
    sample.wheels.push_back({from_seconds(seconds + defect.late_s), defect.factor * velocity_at(seconds), 0.0,
                             0.7 * yaw_rate_at(seconds)});  // skidding wheels overstate or understate turns
  }
  return sample;
}

Platform wheeled() {
  Platform platform;
  platform.suite.wheels.emplace();
  return platform;
}

TEST(WheelChecks, HealthyWheelsAndRobotsWithoutWheelsHaveNoFindings) {
  EXPECT_THAT(check_wheels(drive_of({}), wheeled()), IsEmpty());
  EXPECT_THAT(check_wheels(drive_of({.factor = 1.05, .late_s = 0.01}), wheeled()), IsEmpty());
  EXPECT_THAT(check_wheels(drive_of({.factor = -1000.0}), Platform{}), IsEmpty());
}

TEST(WheelChecks, AVelocityBackwardsAndOneInMillimetresAreFound) {
  const Findings reverse = check_wheels(drive_of({.factor = -1.0}), wheeled());
  ASSERT_EQ(reverse.size(), 1U);
  EXPECT_EQ(reverse[0].kind, "wheels.reverse");
  EXPECT_THAT(reverse[0].change, HasSubstr("wheels.T_imu_wheels"));
  const Findings millimetres = check_wheels(drive_of({.factor = 1000.0}), wheeled());
  ASSERT_EQ(millimetres.size(), 1U);
  EXPECT_EQ(millimetres[0].kind, "wheels.unit");
  EXPECT_THAT(millimetres[0].change, HasSubstr("wheels.scale: "));
}

TEST(WheelChecks, AClockOffsetIsFoundWithItsSign) {
  for (const double late_s : {0.12, -0.08}) {
    Platform platform = wheeled();
    platform.wheels.clock_offset_s = 0.02;  // was subtracted by the reader
    const Findings findings = check_wheels(drive_of({.late_s = late_s}), platform);
    ASSERT_EQ(findings.size(), 1U);
    EXPECT_EQ(findings[0].kind, "clock.wheels");
    const std::string key = "wheels.clock_offset_s: ";
    ASSERT_EQ(findings[0].change.rfind(key, 0), 0U);
    EXPECT_NEAR(std::stod(findings[0].change.substr(key.size())), 0.02 + late_s, 0.006);
  }
}

TEST(WheelChecks, AMissingTopicNamesTheKey) {
  LogSample sample;
  StreamSample stream;
  stream.sensor = Sensor::wheels;
  stream.topic = "/wheels";
  stream.key = "wheels.topic";
  sample.streams.push_back(stream);
  Findings findings = check_topics(sample, wheeled());
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_EQ(findings[0].severity, Severity::error);
  EXPECT_THAT(findings[0].change, HasSubstr("section wheels"));
  TopicInfo odometry;
  odometry.name = "/odom";
  odometry.type = "nav_msgs/Odometry";
  odometry.messages = 100;
  sample.topics.push_back(odometry);
  findings = check_topics(sample, wheeled());
  EXPECT_THAT(findings[0].change, HasSubstr("wheels.topic: /odom"));
}

}  // namespace
}  // namespace lodestone

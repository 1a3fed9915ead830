// `lodestone init` as called by users.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/frontends/logs/synthetic_log.h"
#include "tests/tools/program_runner.h"

namespace lodestone {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

class InitCommand : public ::testing::Test {
 protected:
  InitCommand() {
    testing::SyntheticLog log;
    log.scans = 30;
    log.on_imu = [](int i, ros1::ImuMessage& imu) {
      imu.angular_velocity = {1e-3 * std::sin(12.9898 * i), 1e-3 * std::sin(78.233 * i), 1e-3 * std::sin(37.719 * i)};
      imu.linear_acceleration[0] = 0.02 * std::sin(4.1414 * i);
      return true;
    };
    log.on_field = [](int i, int k, ros1::MagneticFieldMessage& field) {
      field.field_tesla[0] += 1e-6 * std::sin(12.9898 * i + k);
      return true;
    };
    log.write(path("log.bag"));
  }

  std::string path(const std::string& name) const { return (folder_ / name).string(); }

  TemporaryFolder folder_;
};

TEST_F(InitCommand, TheFileIsCheckedWithoutAnError) {
  const ProgramResult written = run_lodestone("init " + path("log.bag") + " --out " + path("robot.yaml"));
  ASSERT_EQ(written.code, 0) << written.errors;
  EXPECT_THAT(written.output, HasSubstr("LiDAR /ouster/points, IMU /imu/data, 2 magnetometer(s)"));
  EXPECT_THAT(written.output, HasSubstr("next: lodestone check " + path("log.bag")));
  const ProgramResult checked = run_lodestone("check " + path("log.bag") + " --platform " + path("robot.yaml"));
  EXPECT_EQ(checked.code, 0) << checked.output << checked.errors;
  EXPECT_THAT(checked.output, Not(HasSubstr("topic.missing")));
  EXPECT_THAT(checked.output, Not(HasSubstr("imu.rate")));
  EXPECT_THAT(checked.output, Not(HasSubstr("lidar.period")));
  EXPECT_THAT(content_of(path("robot.yaml")), HasSubstr("translation_sigma_m: 0.01\n"));
  // The log has no /tf_static: check says so until somebody has measured the mountings.
  EXPECT_THAT(checked.output, HasSubstr("platform.guesses"));
  EXPECT_THAT(checked.output, HasSubstr("nobody measured lidar.T_imu_lidar, magnetometers[0].T_imu_mag"));
  EXPECT_THAT(checked.output, Not(HasSubstr("magnetometer.same_place")));
}

TEST_F(InitCommand, ReplacesAFileOnlyWithForce) {
  const std::string call = "init " + path("log.bag") + " --out " + path("robot.yaml");
  std::ofstream(path("robot.yaml")) << "name: mine\n";
  expect_refused(call, "--out " + path("robot.yaml") + ": the file exists; choose another name, or set --force");
  EXPECT_EQ(content_of(path("robot.yaml")), "name: mine\n");
  EXPECT_EQ(run_lodestone(call + " --force").code, 0);
  EXPECT_THAT(content_of(path("robot.yaml")), HasSubstr("name: \"robot\""));
}

TEST_F(InitCommand, RefusesInOneLine) {
  expect_refused("init " + path("log.bag") + " --out " + path("robot.txt"), "expected a name ending in .yaml");
  expect_refused("init " + path("absent.bag") + " --out " + path("robot.yaml"), path("absent.bag"));
  expect_refused("init " + path("log.bag") + " --seconds 0 --out " + path("robot.yaml"), "--seconds: expected");
  EXPECT_FALSE(std::filesystem::exists(path("robot.yaml")));
}

}  // namespace
}  // namespace lodestone

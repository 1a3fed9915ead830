// `lodestone init` as called by users.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "frontends/configuration/configuration_node.h"
#include "tests/frontends/logs/synthetic_log.h"
#include "tests/frontends/logs/test_files.h"
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

TEST_F(InitCommand, DescribesARobotWithoutLidar) {
  testing::SyntheticLog log;
  log.scans = 30;
  log.lidar = false;
  log.write(path("blind.bag"));
  const ProgramResult written = run_lodestone("init " + path("blind.bag") + " --out " + path("robot.yaml"));
  ASSERT_EQ(written.code, 0) << written.errors;
  EXPECT_THAT(written.output, HasSubstr("no LiDAR, IMU /imu/data, 2 magnetometer(s)"));
  const ProgramResult checked = run_lodestone("check " + path("blind.bag") + " --platform " + path("robot.yaml"));
  EXPECT_THAT(checked.output, Not(HasSubstr("topic.missing"))) << checked.errors;
  // Several logs are checked as one folder.
  const std::string both = path("blind.bag") + " " + path("log.bag");
  EXPECT_THAT(run_lodestone("init " + both + " --force --out " + path("robot.yaml")).output,
              HasSubstr("next: put these logs into one folder; lodestone check FOLDER"));
}

class InitOfRealLogs : public ::testing::TestWithParam<const char*> {};

TEST_P(InitOfRealLogs, IsCheckedWithoutAnError) {
  LODESTONE_REAL_DATA(log, GetParam());
  const TemporaryFolder folder;
  const std::string robot = (folder / "robot.yaml").string();
  const ProgramResult written = run_lodestone("init " + log + " --out " + robot);
  ASSERT_EQ(written.code, 0) << written.errors;
  const ProgramResult checked = run_lodestone("check " + log + " --platform " + robot);
  EXPECT_EQ(checked.code, 0) << checked.output << checked.errors;
}

INSTANTIATE_TEST_SUITE_P(Logs, InitOfRealLogs,
                         ::testing::Values("bags/ardrone_imu.bag", "bags/ouster_os1_128_ros1_bz2.bag",
                                           "bags/ouster_os1_128_ros2_mcap", "bags/rosbags-rs-db3",
                                           "magnetic/aalto_logs/survey_2_3", "real_scans/log"));

TEST_F(InitCommand, ReplacesAFileOnlyWithForce) {
  const std::string call = "init " + path("log.bag") + " --out " + path("robot.yaml");
  std::ofstream(path("robot.yaml")) << "name: mine\n";
  expect_refused(call, "--out " + path("robot.yaml") + ": the file exists; choose another name, or set --force");
  EXPECT_EQ(content_of(path("robot.yaml")), "name: mine\n");
  EXPECT_EQ(run_lodestone(call + " --force").code, 0);
  EXPECT_THAT(content_of(path("robot.yaml")), HasSubstr("name: \"robot\""));
}

constexpr const char* kKalibr =
    "accelerometer_noise_density: 1.86e-03\n"
    "accelerometer_random_walk:   4.33e-04\n"
    "gyroscope_noise_density:     1.87e-04\n"
    "gyroscope_random_walk:       2.66e-05\n"
    "update_rate:                 200.0\n";

TEST_F(InitCommand, TakesTheNoiseOfTheImuFromAFileForKalibr) {
  const std::string call = "init " + path("log.bag") + " --imu-noise " + path("imu.yaml") + " --out ";
  std::ofstream(path("imu.yaml")) << kKalibr << "rostopic: /imu0\n";
  ASSERT_EQ(run_lodestone(call + path("one.yaml")).code, 0);
  const std::string how = "  # stated by imu.yaml for the topic /imu0\n";
  for (const char* line :
       {"gyroscope_noise_density_rad_s_sqrt_hz: 0.000187", "accelerometer_noise_density_m_s2_sqrt_hz: 0.00186",
        "gyroscope_bias_random_walk_rad_s2_sqrt_hz: 2.66e-05",
        "accelerometer_bias_random_walk_m_s3_sqrt_hz: 0.000433"}) {
    EXPECT_THAT(content_of(path("one.yaml")), HasSubstr(line + how));
  }
  // Of several IMUs, that of the log's topic.
  const auto section = [](const std::string& name, const std::string& topic, const std::string& density) {
    return name + ":\n  accelerometer_noise_density: " + density +
           "\n  accelerometer_random_walk: 1e-4\n  gyroscope_noise_density: 1e-4\n  gyroscope_random_walk: 1e-5\n"
           "  rostopic: " +
           topic + "\n";
  };
  std::ofstream(path("imu.yaml")) << section("imu0", "/other", "0.01") << section("imu1", "/imu/data", "0.02");
  ASSERT_EQ(run_lodestone(call + path("two.yaml")).code, 0);
  EXPECT_THAT(content_of(path("two.yaml")),
              HasSubstr("accelerometer_noise_density_m_s2_sqrt_hz: 0.02  # stated by imu.yaml\n"));
}

// As cv::FileStorage writes it. What imu_utils calls the noise is that of one sample, at the rate of the IMU.
TEST_F(InitCommand, TakesTheNoiseOfASampleFromAFileOfImuUtils) {
  const std::string axes = "   x-axis:\n      gyr_n: 9.0\n";
  std::ofstream(path("imu.yaml")) << "%YAML:1.0\n---\ntype: IMU\nname: BMI160\nGyr:\n   unit: \" rad/s\"\n"
                                     "   avg-axis:\n      gyr_n: 1.2e-03\n      gyr_w: 2.6e-05\n"
                                  << axes << "Acc:\n   avg-axis:\n      acc_n: 2.0e-02\n      acc_w: 5.2e-04\n";
  const std::string call = "init " + path("log.bag") + " --imu-noise " + path("imu.yaml") + " --out ";
  const ProgramResult written = run_lodestone(call + path("one.yaml"));
  ASSERT_EQ(written.code, 0) << written.errors;
  const std::string text = content_of(path("one.yaml"));
  const ConfigurationNode imu = ConfigurationNode::load(path("one.yaml")).at("imu");
  const double rate_hz = imu.at("rate_hz").as_double();
  EXPECT_NEAR(imu.at("gyroscope_noise_density_rad_s_sqrt_hz").as_double(), 1.2e-3 / std::sqrt(rate_hz), 1e-7);
  EXPECT_NEAR(imu.at("accelerometer_noise_density_m_s2_sqrt_hz").as_double(), 2e-2 / std::sqrt(rate_hz), 1e-6);
  EXPECT_THAT(text, HasSubstr(fmt::format("# stated by imu.yaml for one sample, at {:g} Hz", rate_hz)));
  // A bias instability is no random walk.
  EXPECT_THAT(text, HasSubstr("gyroscope_bias_random_walk_rad_s2_sqrt_hz: 2e-05  # guess"));
  std::ofstream(path("imu.yaml")) << "%YAML:1.0\n---\nGyr:\n   avg-axis:\n      gyr_n: 1e-3\n";
  expect_refused(call + path("two.yaml"), "imu.yaml:3: the key 'Acc' is missing");
}

TEST_F(InitCommand, RefusesAFileThatDoesNotStateTheNoise) {
  const std::string call = "init " + path("log.bag") + " --imu-noise " + path("imu.yaml") + " --out " + path("r.yaml");
  expect_refused(call, path("imu.yaml"));
  std::ofstream(path("imu.yaml")) << "gyroscope_noise_density: 1e-4\n";
  expect_refused(call, "accelerometer_noise_density");
  expect_refused("init " + path("log.bag") +
                     " --imu-noise " LODESTONE_SOURCE_DIR "/config/platforms/scout_os32.yaml --out " + path("r.yaml"),
                 "scout_os32.yaml: expected a file of Kalibr, allan_variance_ros or imu_utils, with the key "
                 "'accelerometer_noise_density'; this looks like a platform file");
  std::string wrong = kKalibr;
  wrong.replace(wrong.find("1.87e-04"), 8, "0       ");
  std::ofstream(path("imu.yaml")) << wrong;
  expect_refused(call, "imu.yaml:3: gyroscope_noise_density: expected a number above 0, found 0");
  std::ofstream(path("imu.yaml")) << "imu0:\n  accelerometer_noise_density: 1\n  accelerometer_random_walk: 1\n"
                                     "  gyroscope_noise_density: 1\n  gyroscope_random_walk: 1\n  rostopic: /a\n"
                                     "imu1:\n  accelerometer_noise_density: 1\n  accelerometer_random_walk: 1\n"
                                     "  gyroscope_noise_density: 1\n  gyroscope_random_walk: 1\n  rostopic: /b\n";
  expect_refused(call, "none of the IMUs (/a, /b) is the log's, /imu/data");
  EXPECT_FALSE(std::filesystem::exists(path("r.yaml")));
}

TEST_F(InitCommand, RefusesInOneLine) {
  expect_refused("init " + path("log.bag") + " --out " + path("robot.txt"), "expected a name ending in .yaml");
  expect_refused("init " + path("absent.bag") + " --out " + path("robot.yaml"), path("absent.bag"));
  expect_refused("init " + path("log.bag") + " " + path("./log.bag") + " --out " + path("robot.yaml"),
                 "is given twice");
  expect_refused("init " + path("log.bag") + " --seconds 0 --out " + path("robot.yaml"), "--seconds: expected");
  EXPECT_FALSE(std::filesystem::exists(path("robot.yaml")));
}

}  // namespace
}  // namespace lodestone

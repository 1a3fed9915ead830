#include "frontends/configuration/platform.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "core/error.h"
#include "frontends/configuration/text_file.h"
#include "tests/frontends/logs/test_files.h"

namespace lodestone {
namespace {

using ::lodestone::testing::message_of;
using ::testing::HasSubstr;

const std::string scout = std::string(LODESTONE_SOURCE_DIR) + "/config/platforms/scout_os32.yaml";

/// The error message for the Scout's file with `from` replaced by `to`.
std::string error_with(const std::string& from, const std::string& to) {
  std::string text = read_text_file(scout);
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  text.replace(at, from.size(), to);
  return message_of<InputError>([&] { parse_platform(text, "scout.yaml"); });
}

TEST(PlatformFile, EveryShippedFileLoads) {
  int files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(LODESTONE_SOURCE_DIR "/config/platforms")) {
    const Platform platform = load_platform(entry.path().string());
    EXPECT_EQ(platform.name, entry.path().stem().string());
    ++files;
  }
  EXPECT_GE(files, 6);
}

TEST(PlatformFile, TheImuOfAnOs1IsBelowAndBesideTheLidar) {
  const Platform os1 = load_platform(LODESTONE_SOURCE_DIR "/config/platforms/os1.yaml");
  // The sensor's metadata, mm.
  const Pose T_sensor_imu{Quaternion::Identity(), Vector3(6.253, -11.775, 7.645) * 1e-3};
  const Pose T_sensor_lidar{Quaternion(0.0, 0.0, 0.0, 1.0), Vector3(0.0, 0.0, 36.18) * 1e-3};
  const Pose expected = T_sensor_imu.inverse() * T_sensor_lidar;
  EXPECT_LT(os1.suite.lidar.T_imu_lidar.boxminus(expected).norm(), 1e-12);
}

TEST(PlatformFile, DescribesTheScout) {
  const Platform platform = load_platform(scout);
  EXPECT_EQ(platform.lidar.topic, "/ouster/points");
  EXPECT_EQ(platform.lidar.time_field, "t");
  EXPECT_EQ(platform.imu.topic, "/imu/data");
  ASSERT_EQ(platform.suite.magnetometers.size(), 8U);
  ASSERT_EQ(platform.magnetometers.size(), 8U);
  EXPECT_EQ(platform.magnetometers[7].topic, "/magnetometer_7/field");
  EXPECT_EQ(platform.magnetometers[7].unit, FieldUnit::tesla);
  const auto& magnetometers = platform.suite.magnetometers;
  EXPECT_NEAR((magnetometers[0].T_imu_mag.position - magnetometers[3].T_imu_mag.position).norm(), 0.5, 1e-12);
  EXPECT_NEAR((magnetometers[0].T_imu_mag.position - magnetometers[4].T_imu_mag.position).norm(), 0.6, 1e-12);
  EXPECT_NEAR(platform.suite.lidar.T_imu_lidar.position.z() - magnetometers[0].T_imu_mag.position.z(), 0.38, 1e-12);
}

/// The error of scout.yaml with a section `wheels` in which `from` is replaced.
std::string error_with(std::string wheels, const std::string& from, const std::string& to) {
  wheels.replace(wheels.find(from), from.size(), to);
  return message_of<InputError>([&] { parse_platform(read_text_file(scout) + wheels, "scout.yaml"); });
}

TEST(PlatformFile, ReadsBackWheels) {
  EXPECT_FALSE(load_platform(scout).suite.wheels);
  const std::string wheels =
      "\nwheels:\n  topic: /odom\n  velocity_sigma_m_s: 0.03\n  lateral_motion: none\n  lateral_sigma_m_s: 0.07\n"
      "  scale: 1.02\n  clock_offset_s: -0.01\n  linear_velocity: twist.linear\n  angular_velocity: twist.angular\n"
      "  T_imu_wheels:\n    translation_m: [-0.1, 0.2, -0.3]\n    quaternion_xyzw: [0, 0, 0.6, 0.8]\n"
      "  calibration:\n    scale_sigma: 0.02\n    slip_sigma: 0.001\n";
  const testing::TemporaryFolder folder;
  save_platform(parse_platform(read_text_file(scout) + wheels, "scout.yaml"), folder / "platform.yaml");
  const Platform back = load_platform(folder / "platform.yaml");
  ASSERT_TRUE(back.suite.wheels);
  EXPECT_EQ(back.wheels.topic, "/odom");
  EXPECT_EQ(back.wheels.scale, 1.02);
  EXPECT_EQ(back.wheels.clock_offset_s, -0.01);
  EXPECT_EQ(back.wheels.linear_velocity_path, "twist.linear");
  EXPECT_EQ(back.wheels.angular_velocity_path, "twist.angular");
  EXPECT_EQ(back.suite.wheels->velocity_sigma_m_s, 0.03);
  EXPECT_EQ(back.suite.wheels->lateral_motion, LateralMotion::none);
  EXPECT_EQ(back.suite.wheels->lateral_sigma_m_s, 0.07);
  EXPECT_EQ(back.suite.wheels->T_imu_wheels.position, Vector3(-0.1, 0.2, -0.3));
  EXPECT_EQ(back.suite.calibration.wheels.scale_sigma, 0.02);
  EXPECT_EQ(back.suite.calibration.wheels.rotation_sigma_deg, WheelCalibrationSigmas{}.rotation_sigma_deg);
  EXPECT_EQ(back.suite.calibration.wheels.slip_sigma, 0.001);
  const auto error = [&](const std::string& from, const std::string& to) { return error_with(wheels, from, to); };
  EXPECT_THAT(error("scale: 1.02", "scale: 0"), HasSubstr("above 0"));
  EXPECT_THAT(error("slip_sigma", "slipping"), HasSubstr("slipping"));
  EXPECT_THAT(error("lateral_motion: none", "lateral_motion: unknown"), HasSubstr("lateral_motion: none"));
}

TEST(PlatformFile, ReadsBackAWheelOnEachSide) {
  const std::string wheels =
      "\nwheels:\n  topic: /joint_states\n  left_position: position[0]\n  right_position: -position[1]\n"
      "  track_m: 0.58\n  velocity_sigma_m_s: 0.03\n"
      "  T_imu_wheels:\n    translation_m: [0, 0, 0]\n    quaternion_xyzw: [0, 0, 0, 1]\n";
  const testing::TemporaryFolder folder;
  save_platform(parse_platform(read_text_file(scout) + wheels, "scout.yaml"), folder / "platform.yaml");
  const Platform back = load_platform(folder / "platform.yaml");
  EXPECT_EQ(back.wheels.left_path, "position[0]");
  EXPECT_EQ(back.wheels.right_path, "-position[1]");
  EXPECT_TRUE(back.wheels.positions);
  EXPECT_EQ(back.wheels.track_m, 0.58);
  const auto error = [&](const std::string& from, const std::string& to) { return error_with(wheels, from, to); };
  EXPECT_THAT(error("  track_m: 0.58\n", ""), HasSubstr("track_m"));
  EXPECT_THAT(error("right_position: -position[1]", "right_velocity: velocity[1]"), HasSubstr("right_velocity"));
  EXPECT_THAT(error("  track_m", "  linear_velocity: a\n  angular_velocity: b\n  track_m"),
              HasSubstr("cannot be used beside left_position"));
  EXPECT_THAT(error("  track_m", "  lateral_motion: measured\n  track_m"), HasSubstr("lateral"));
}

TEST(PlatformFile, AShippedFileHasWheelsWithTheUsualSigmas) {
  const Platform platform = load_platform(std::string(LODESTONE_SOURCE_DIR) + "/config/platforms/scout_wheels.yaml");
  ASSERT_TRUE(platform.suite.wheels);
  EXPECT_EQ(platform.wheels.topic, "/odom");
  EXPECT_EQ(platform.suite.wheels->lateral_motion, LateralMotion::unknown);
  EXPECT_EQ(platform.suite.calibration.wheels.scale_sigma, WheelCalibrationSigmas{}.scale_sigma);
  EXPECT_EQ(platform.suite.calibration.wheels.slip_sigma, WheelCalibrationSigmas{}.slip_sigma);
  EXPECT_TRUE(platform.suite.magnetometers.empty());
}

TEST(PlatformFile, ReadsBackWhatItWrote) {
  const testing::TemporaryFolder folder;
  Platform platform = load_platform(scout);
  platform.lidar.ring_field.clear();
  platform.guesses = {"lidar.T_imu_lidar", "magnetometers[2].T_imu_mag"};
  platform.lidar.stamp = ScanStamp::end;
  platform.lidar.time_unit = PointTimeUnit::seconds;
  platform.suite.lidar.T_imu_lidar = {so3::exp(Vector3(0.1, -0.2, 3.0)), Vector3(1.0 / 3.0, -0.1, 1e-9)};
  platform.suite.magnetometers[2].noise_ut = 0.1 + 0.2;
  platform.magnetometers[5].unit = FieldUnit::gauss;
  platform.magnetometers[3].hard_iron_ut = Vector3(1.0 / 3.0, -12.5, 0.1);
  platform.magnetometers[3].soft_iron_correction << 1.01, 0.1 / 3.0, 0.0, -0.02, 0.99, 0.01, 0.0, 0.03, 1.0;
  platform.imu.acceleration_unit = AccelerationUnit::standard_gravity;
  platform.imu.angular_velocity_path = "board.rate";
  platform.imu.linear_acceleration_path = "board.acceleration";
  platform.lidar.time_zero = PointTimeZero::lidar_clock;
  platform.magnetometers[6] = {platform.magnetometers[5].topic, FieldUnit::nanotesla, "data[3]"};
  save_platform(platform, folder / "platform.yaml");
  const Platform back = load_platform(folder / "platform.yaml");
  EXPECT_EQ(back.name, platform.name);
  EXPECT_EQ(back.lidar.ring_field, "");
  EXPECT_EQ(back.guesses, platform.guesses);
  EXPECT_EQ(back.lidar.stamp, ScanStamp::end);
  EXPECT_EQ(back.lidar.time_unit, PointTimeUnit::seconds);
  ASSERT_EQ(back.magnetometers.size(), platform.magnetometers.size());
  EXPECT_EQ(back.magnetometers[5].topic, platform.magnetometers[5].topic);
  EXPECT_EQ(back.magnetometers[5].unit, FieldUnit::gauss);
  EXPECT_EQ(back.magnetometers[5].path, "");
  EXPECT_EQ(back.magnetometers[6].path, "data[3]");
  EXPECT_EQ(back.magnetometers[6].unit, FieldUnit::nanotesla);
  EXPECT_EQ(back.imu.linear_acceleration_path, "board.acceleration");
  EXPECT_EQ(back.lidar.time_zero, PointTimeZero::lidar_clock);
  EXPECT_EQ(back.magnetometers[3].hard_iron_ut, platform.magnetometers[3].hard_iron_ut);
  EXPECT_EQ(back.magnetometers[3].soft_iron_correction, platform.magnetometers[3].soft_iron_correction);
  EXPECT_FALSE(back.magnetometers[4].calibrated());
  EXPECT_EQ(back.imu.acceleration_unit, AccelerationUnit::standard_gravity);
  EXPECT_EQ(back.suite.lidar.T_imu_lidar.rotation.coeffs(), platform.suite.lidar.T_imu_lidar.rotation.coeffs());
  EXPECT_EQ(back.suite.lidar.T_imu_lidar.position, platform.suite.lidar.T_imu_lidar.position);
  EXPECT_EQ(back.suite.magnetometers[2].noise_ut, platform.suite.magnetometers[2].noise_ut);
  EXPECT_EQ(back.suite.imu.gyroscope_noise_density, platform.suite.imu.gyroscope_noise_density);
  platform.suite.magnetometers.clear();
  platform.magnetometers.clear();
  save_platform(platform, folder / "platform.yaml");
  EXPECT_TRUE(load_platform(folder / "platform.yaml").suite.magnetometers.empty());
}

TEST(PlatformFile, CalibrationSigmasAreThoseOfAUsualRobotUnlessTheyAreStated) {
  const CalibrationSigmas usual = load_platform(scout).suite.calibration;
  EXPECT_EQ(usual.lidar.translation_sigma_m, 0.010);
  EXPECT_EQ(usual.lidar.rotation_sigma_deg, 0.3);
  EXPECT_EQ(usual.lidar.clock_sigma_s, 0.003);
  EXPECT_EQ(usual.lidar.map_displacement_sigma_m, 0.020);
  EXPECT_EQ(usual.magnetometers.offset_sigma_ut, 1.0);
  EXPECT_EQ(usual.imu.misalignment_sigma_deg, 0.1);
  std::string text = read_text_file(scout);
  text.replace(text.find("lidar:\n"), 7, "lidar:\n  calibration: {rotation_sigma_deg: 0.05, clock_sigma_s: 0}\n");
  text.replace(text.find("imu:\n"), 5, "imu:\n  calibration: {scale_sigma: 0.1}\n");
  text += "magnetometer_calibration: {matrix_sigma: 0.3}\n";
  const CalibrationSigmas stated = parse_platform(text, "scout.yaml").suite.calibration;
  EXPECT_EQ(stated.lidar.translation_sigma_m, 0.010);
  EXPECT_EQ(stated.lidar.rotation_sigma_deg, 0.05);
  EXPECT_EQ(stated.lidar.clock_sigma_s, 0.0);
  EXPECT_EQ(stated.imu.scale_sigma, 0.1);
  EXPECT_EQ(stated.magnetometers.matrix_sigma, 0.3);
  EXPECT_EQ(stated.magnetometers.clock_sigma_s, 0.010);
}

TEST(PlatformFile, CalibrationSigmasReadBackToTheSameBits) {
  const testing::TemporaryFolder folder;
  Platform platform = load_platform(scout);
  CalibrationSigmas& sigmas = platform.suite.calibration;
  sigmas.lidar = {1.0 / 3.0, 0.1 / 3.0, 0.0, 0.1 / 7.0};
  sigmas.magnetometers = {0.001 / 3.0, 2.0 / 3.0, 1e-9, 0.7, 0.01 / 3.0};
  sigmas.imu = {0.001 / 7.0, 0.02 / 7.0};
  save_platform(platform, folder / "platform.yaml");
  const CalibrationSigmas back = load_platform(folder / "platform.yaml").suite.calibration;
  EXPECT_EQ(back.lidar.translation_sigma_m, sigmas.lidar.translation_sigma_m);
  EXPECT_EQ(back.lidar.rotation_sigma_deg, sigmas.lidar.rotation_sigma_deg);
  EXPECT_EQ(back.lidar.clock_sigma_s, 0.0);
  EXPECT_EQ(back.lidar.map_displacement_sigma_m, sigmas.lidar.map_displacement_sigma_m);
  EXPECT_EQ(back.magnetometers.translation_sigma_m, sigmas.magnetometers.translation_sigma_m);
  EXPECT_EQ(back.magnetometers.rotation_sigma_deg, sigmas.magnetometers.rotation_sigma_deg);
  EXPECT_EQ(back.magnetometers.clock_sigma_s, sigmas.magnetometers.clock_sigma_s);
  EXPECT_EQ(back.magnetometers.offset_sigma_ut, sigmas.magnetometers.offset_sigma_ut);
  EXPECT_EQ(back.magnetometers.matrix_sigma, sigmas.magnetometers.matrix_sigma);
  EXPECT_EQ(back.imu.scale_sigma, sigmas.imu.scale_sigma);
  EXPECT_EQ(back.imu.misalignment_sigma_deg, sigmas.imu.misalignment_sigma_deg);
}

TEST(PlatformFile, ClockOffsetsAndACommentReadBackToTheSameBits) {
  const testing::TemporaryFolder folder;
  Platform platform = load_platform(scout);
  EXPECT_EQ(platform.lidar.clock_offset_s, 0.0);
  platform.further_lidars = {platform.lidar};
  platform.suite.further_lidars = {platform.suite.lidar};
  platform.lidar.clock_offset_s = -0.01 / 3.0;
  platform.further_lidars[0].clock_offset_s = 0.1;
  platform.magnetometer_clock_offset_s = 0.02 / 3.0;
  save_platform(platform, folder / "platform.yaml", "made of: robot.yaml\nname: of another");
  const Platform back = load_platform(folder / "platform.yaml");
  EXPECT_EQ(back.name, platform.name);
  EXPECT_EQ(back.lidar.clock_offset_s, platform.lidar.clock_offset_s);
  EXPECT_EQ(back.further_lidars.at(0).clock_offset_s, 0.1);
  EXPECT_EQ(back.magnetometer_clock_offset_s, platform.magnetometer_clock_offset_s);
  EXPECT_THAT(read_text_file(folder / "platform.yaml"),
              ::testing::StartsWith("# made of: robot.yaml\n# name: of another\nname:"));
}

/// The Scout with a second LiDAR whose description ends with `lines`.
std::string with_rear_lidar(const std::string& lines) {
  return read_text_file(scout) +
         "\nfurther_lidars:\n  - topic: /rear/points\n    min_range_m: 0.5\n    max_range_m: 60.0\n"
         "    scan_period_s: 0.1\n    T_imu_lidar: {translation_m: [-0.4, 0, 0.3], quaternion_xyzw: [0, 0, 1, 0]}\n" +
         lines;
}

TEST(PlatformFile, AFurtherLidarHasANoiseOfItsOwn) {
  const testing::TemporaryFolder folder;
  const std::string noise = "    range_noise_m: 0.2\n    direction_noise_rad: 0.003\n";
  Platform platform = parse_platform(with_rear_lidar(noise), "scout.yaml");
  ASSERT_EQ(platform.suite.further_lidars.size(), 1U);
  platform.suite.further_lidars[0].range_noise_m /= 3.0;
  save_platform(platform, folder / "platform.yaml");
  const Platform back = load_platform(folder / "platform.yaml");
  ASSERT_EQ(back.suite.further_lidars.size(), 1U);
  EXPECT_EQ(back.suite.further_lidars[0].range_noise_m, 0.2 / 3.0);
  EXPECT_EQ(back.suite.further_lidars[0].direction_noise_rad, 0.003);
  EXPECT_EQ(back.suite.further_lidars[0].max_range_m, 60.0);
  EXPECT_EQ(back.suite.lidar.range_noise_m, load_platform(scout).suite.lidar.range_noise_m);
  EXPECT_EQ(back.further_lidars.at(0).topic, "/rear/points");
}

TEST(PlatformFile, AFurtherLidarWithoutNoiseIsAsTheFirst) {
  const Platform platform = parse_platform(with_rear_lidar(""), "scout.yaml");
  ASSERT_EQ(platform.suite.further_lidars.size(), 1U);
  EXPECT_EQ(platform.suite.further_lidars[0].range_noise_m, platform.suite.lidar.range_noise_m);
  EXPECT_EQ(platform.suite.further_lidars[0].direction_noise_rad, platform.suite.lidar.direction_noise_rad);
}

TEST(PlatformFile, AFurtherLidarsMistakesNameItsKeys) {
  const auto error = [](const std::string& lines) {
    return message_of<InputError>([&] { parse_platform(with_rear_lidar(lines), "scout.yaml"); });
  };
  EXPECT_THAT(error("    range_noise_m: 0\n"), HasSubstr("further_lidars[0].range_noise_m: expected a number above 0"));
  EXPECT_THAT(error("    direction_noise_rad: -1\n"),
              HasSubstr("further_lidars[0].direction_noise_rad: expected a number of at least 0"));
  EXPECT_THAT(error("    range_nose_m: 0.1\n"), HasSubstr("did you mean 'range_noise_m'"));
  EXPECT_THAT(error("    calibration: {clock_sigma_s: 0.1}\n"), HasSubstr("further_lidars[0]"));
  std::string many;
  for (int i = 1; i < 256; ++i) {
    many +=
        "  - {topic: /more, min_range_m: 0.5, max_range_m: 60.0, scan_period_s: 0.1,"
        " T_imu_lidar: {translation_m: [0, 0, 0], quaternion_xyzw: [0, 0, 0, 1]}}\n";
  }
  EXPECT_THAT(error(many), HasSubstr("expected at most 255 further LiDARs"));
}

TEST(PlatformFile, WrongClockOffsetsAreRefusedWithTheirPlace) {
  for (const char* value : {".inf", "-4000", "1700000000"}) {
    const std::string key = "clock_offset_s: " + std::string(value) + "\n";
    EXPECT_THAT(error_with("lidar:\n", "lidar:\n  " + key), HasSubstr("lidar.clock_offset_s: expected seconds"))
        << value;
    EXPECT_THAT(error_with("lidar:\n", "magnetometer_" + key + "lidar:\n"),
                HasSubstr("magnetometer_clock_offset_s: expected seconds"))
        << value;
  }
  EXPECT_THAT(error_with("lidar:\n", "lidar:\n  clock_offset_s: .nan\n"),
              HasSubstr("lidar.clock_offset_s: expected a number"));
  EXPECT_THAT(error_with("lidar:\n", "lidar:\n  clock_ofset_s: 0.1\n"), HasSubstr("did you mean 'clock_offset_s'"));
}

TEST(PlatformFile, WrongCalibrationSigmasAreRefusedWithTheirPlace) {
  const auto error_of = [](const std::string& calibration) {
    return error_with("lidar:\n", "lidar:\n  calibration: " + calibration + "\n");
  };
  EXPECT_THAT(error_of("{rotation_sigma: 1}"), HasSubstr("rotation_sigma_deg"));
  for (const char* value : {"-0.1", ".nan", ".inf", "2"}) {
    const std::string message = error_of("{translation_sigma_m: " + std::string(value) + "}");
    EXPECT_THAT(message, HasSubstr("lidar.calibration.translation_sigma_m")) << value;
    EXPECT_THAT(message, HasSubstr("expected a")) << value;
  }
  EXPECT_THAT(error_of("{translation_sigma_m: 2}"), HasSubstr("0 (exact) to 1"));
  EXPECT_THAT(error_of("3"), HasSubstr("calibration"));
}

TEST(PlatformFile, WhatIsLeftOutOfTheCloudIsLeftToItsContent) {
  std::string text = read_text_file(scout);
  for (const std::string line : {"  stamp: start", "  time_unit: ns", "    time: t"}) {
    const std::size_t at = text.find(line);
    ASSERT_NE(at, std::string::npos) << line;
    text.erase(at, text.find('\n', at) + 1 - at);
  }
  const testing::TemporaryFolder folder;
  save_platform(parse_platform(text, "scout.yaml"), folder / "platform.yaml");
  const LidarMessageLayout layout = load_platform(folder / "platform.yaml").lidar;
  EXPECT_FALSE(layout.stamp.has_value());
  EXPECT_FALSE(layout.time_unit.has_value());
  EXPECT_EQ(layout.time_field, "");
  EXPECT_EQ(layout.ring_field, "ring");
}

TEST(PlatformFile, DeskewedScansHaveNoTimesOfPoints) {
  std::string text = read_text_file(scout);
  EXPECT_EQ(parse_platform(text, "scout.yaml").lidar.point_times, PointTimes::field) << "unless it is stated";
  for (const std::string line : {"  time_unit: ns", "    time: t"}) {
    const std::size_t at = text.find(line);
    ASSERT_NE(at, std::string::npos) << line;
    text.erase(at, text.find('\n', at) + 1 - at);
  }
  text.replace(text.find("lidar:\n"), 7, "lidar:\n  point_times: none\n");
  const testing::TemporaryFolder folder;
  save_platform(parse_platform(text, "scout.yaml"), folder / "platform.yaml");
  EXPECT_EQ(load_platform(folder / "platform.yaml").lidar.point_times, PointTimes::none);
  // A key that describes point times contradicts point_times: none.
  EXPECT_THAT(error_with("lidar:\n", "lidar:\n  point_times: none\n"),
              ::testing::AllOf(HasSubstr("lidar.fields.time"), HasSubstr("point_times: none ignores point times")));
  EXPECT_THAT(error_with("lidar:\n", "lidar:\n  point_times: non\n"), HasSubstr("did you mean 'none'"));
  EXPECT_THAT(error_with("lidar:\n", "lidar:\n  point_time: none\n"), HasSubstr("did you mean 'point_times'"));
}

TEST(PlatformFile, LidarAndImuMayBeMissingIfTheyAreNotRequired) {
  const testing::TemporaryFolder folder;
  testing::write_text(folder / "array.yaml",
                      "name: array\nmagnetometers:\n  - {name: a, topic: /a, unit: tesla, noise_ut: 1.0, T_imu_mag: "
                      "{translation_m: [0, 0, 0], quaternion_xyzw: [0, 0, 0, 1]}}\n");
  const Platform platform = load_platform(folder / "array.yaml", {.lidar = false, .imu = false});
  EXPECT_EQ(platform.magnetometers.at(0).topic, "/a");
  EXPECT_FALSE(platform.has_lidar());
  save_platform(platform, folder / "again.yaml");
  EXPECT_FALSE(load_platform(folder / "again.yaml", {.lidar = false}).has_lidar());
  EXPECT_THAT(message_of<InputError>([&] { load_platform(folder / "array.yaml"); }),
              HasSubstr("the key 'lidar' is missing"));
  EXPECT_THAT(message_of<InputError>([&] { load_platform(folder / "array.yaml", {.lidar = false}); }),
              HasSubstr("the key 'imu' is missing"));
}

TEST(PlatformFile, NamesFileLineAndKeyOfAMistake) {
  EXPECT_THAT(error_with("max_range_m:", "max_rnge_m:"), HasSubstr("did you mean 'max_range_m'"));
  EXPECT_THAT(error_with("max_range_m: 100.0", "max_range_m: far"), HasSubstr("lidar.max_range_m: expected a number"));
  EXPECT_THAT(error_with("  rate_hz: 200.0\n", ""), HasSubstr("imu: the key 'rate_hz' is missing"));
  EXPECT_THAT(error_with("rate_hz: 200.0", "rate_hz: 0"), HasSubstr("above 0"));
  for (const char* gravity : {"gravity_m_s2: 9807", "gravity_m_s2: 1.0", "gravity_m_s2: -9.81"}) {
    EXPECT_THAT(error_with("gravity_m_s2: 9.80665", gravity), HasSubstr("gravity_m_s2: expected 1.5 to 25 m/s2"));
  }
  EXPECT_THAT(error_with("stamp: start", "stamp: begin"), HasSubstr("one of start, middle, end"));
  EXPECT_THAT(error_with("time_unit: ns", "time_unit: min"), HasSubstr("one of s, ms, us, ns"));
  EXPECT_THAT(error_with("quaternion_xyzw: [0.0, 0.0, 0.0, 1.0]", "quaternion_xyzw: [0.0, 0.0, 0.0, 2.0]"),
              HasSubstr("length is 2.0; expected 1"));
  EXPECT_THAT(error_with("translation_m: [0.05, 0.0, 0.3]", "translation_m: [0.05, 0.0]"),
              HasSubstr("expected a list of 3 numbers, found 2"));
  EXPECT_THAT(error_with("m: [0.05, 0.0, 0.3]", "m: [0.05, 0.0, 300]"), HasSubstr("expected metres, at most 50"));
  EXPECT_THAT(error_with("topic: /imu/data", "topic: ''"), HasSubstr("imu.topic: expected a topic"));
  EXPECT_THAT(error_with("unit: tesla", "unit: telsa"), HasSubstr("did you mean 'tesla'"));
  EXPECT_THAT(error_with("/magnetometer_1/field", "/magnetometer_0/field"),
              ::testing::AllOf(HasSubstr("magnetometers[1].topic"), HasSubstr("set 'values' for each")));
  EXPECT_THAT(error_with("name: front_1", "name: front_0"),
              HasSubstr("another magnetometer already has the name front_0"));
  EXPECT_THAT(error_with("  rate_hz: 200.0\n", "  rate_hz: 200.0\n  angular_velocity: gyro\n"),
              HasSubstr("imu: the key 'linear_acceleration' is missing"));
  EXPECT_THAT(error_with("noise_ut: 1.0", "noise_ut: 1.0\n    hard_iron_ut: [1, 2]"), HasSubstr("a list of 3 numbers"));
  EXPECT_THAT(error_with("noise_ut: 1.0", "noise_ut: 1.0\n    soft_iron_correction: [1, 0, 0, 0, 1, 0, 0, 0, 0]"),
              HasSubstr("a determinant above 0"));
  EXPECT_THAT(error_with("noise_ut: 1.0", "noise_ut: 1.0\n    hard_iron: [1, 2, 3]"),
              HasSubstr("did you mean 'hard_iron_ut'"));
  EXPECT_THAT(message_of<InputError>([] { load_platform("absent.yaml"); }), HasSubstr("no such file"));
}

}  // namespace
}  // namespace lodestone

// The platform file that init drafts, from logs of a robot at rest.
#include "tools/init/platform_draft.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <memory>
#include <numeric>
#include <random>

#include "frontends/logs/log_conversion.h"
#include "frontends/logs/open_log.h"
#include "frontends/messages/result_messages.h"
#include "frontends/messages/wire_ros1.h"
#include "tests/frontends/logs/synthetic_log.h"
#include "tests/frontends/logs/test_files.h"
#include "tools/check/check_call.h"

namespace lodestone {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;
using testing::SyntheticLog;

constexpr double gyroscope_sigma = 2e-3, accelerometer_sigma = 3e-2, field_sigma_ut = 0.4;
const Pose base_imu{so3::exp(Vector3(0.0, 0.0, 0.5)), Vector3(0.1, 0.2, 0.3)};
const Pose base_lidar{so3::exp(Vector3(0.0, 0.2, 0.0)), Vector3(0.5, 0.0, 1.0)};
const Pose lidar_mag{so3::exp(Vector3(1.0, 0.0, 0.0)), Vector3(0.0, 0.0, -0.4)};

struct Edge {
  std::string parent, child;
  Pose pose;
};
const std::vector<Edge> edges{
    {"base", "imu_link", base_imu}, {"base", "laser", base_lidar}, {"laser", "mag_0", lidar_mag}};

/// Six seconds at rest, with white noise. `acceleration_unit` and `field_unit`: of the messages, in m/s² and tesla.
SyntheticLog noisy_robot(double acceleration_unit = 1.0, double field_unit = 1.0) {
  SyntheticLog log;
  log.scans = 60;
  log.points_per_scan = 1024;
  const auto random = std::make_shared<std::mt19937_64>(7);
  const auto noise = [random](double sigma) { return std::normal_distribution<double>(0.0, sigma)(*random); };
  log.on_imu = [=](int, ros1::ImuMessage& imu) {
    imu.frame = "imu_link";
    imu.angular_velocity = {0.01 + noise(gyroscope_sigma), noise(gyroscope_sigma), noise(gyroscope_sigma)};
    for (double& value : imu.linear_acceleration) value = (value + noise(accelerometer_sigma)) / acceleration_unit;
    return true;
  };
  log.on_field = [=](int, int k, ros1::MagneticFieldMessage& field) {
    field.frame = "mag_" + std::to_string(k);
    for (double& value : field.field_tesla) value = (value + 1e-6 * noise(field_sigma_ut)) / field_unit;
    return true;
  };
  log.on_scan = [](int, ros1::PointCloudMessage& cloud, std::vector<std::uint8_t>&) {
    cloud.frame = "laser";
    return true;
  };
  return log;
}

class PlatformDraftTest : public ::testing::Test {
 protected:
  void write(const SyntheticLog& log, const std::string& name) { log.write(folder_ / name); }

  /// A log with one message of one byte, which is too short for its type.
  void write_undecodable(const std::string& log, const std::string& topic, const std::string& type,
                         const std::string& md5, const std::string& definition) {
    TopicInfo info;
    info.name = topic;
    info.type = type;
    info.md5 = md5;
    info.definition = definition;
    ros1::BagWriter writer(folder_ / log, Codec::none);
    const std::uint8_t byte = 0;
    writer.write(info, {1'700'000'000'000'000'000, 0, &byte, 1});
    writer.close();
  }

  CommentedPlatform draft(const std::vector<std::string>& names) {
    std::vector<std::string> logs;
    for (const std::string& name : names) logs.push_back(folder_ / name);
    WarningLog warnings;
    const LogSurvey survey = survey_logs(logs, warnings);
    return draft_platform(survey, "robot", 60.0);
  }

  /// The platform that load_platform reads from the text.
  Platform loaded(const CommentedPlatform& commented) {
    testing::write_text(folder_ / "robot.yaml", commented_text(commented));
    return load_platform(folder_ / "robot.yaml", {.lidar = commented.platform.has_lidar()});
  }

  void expect_robot(const Platform& platform) {
    EXPECT_EQ(platform.lidar.topic, "/ouster/points");
    EXPECT_EQ(platform.lidar.time_field, "t");
    EXPECT_EQ(platform.lidar.time_unit, PointTimeUnit::nanoseconds);
    EXPECT_EQ(platform.lidar.intensity_field, "intensity");
    EXPECT_EQ(platform.lidar.ring_field, "ring");
    EXPECT_NEAR(platform.suite.lidar.scan_period_s, 0.1, 1e-6);
    EXPECT_EQ(platform.imu.topic, "/imu/data");
    EXPECT_NEAR(platform.suite.imu.rate_hz, 200.0, 1e-6);
    const double root_period = std::sqrt(0.005);
    EXPECT_NEAR(platform.suite.imu.gyroscope_noise_density / (gyroscope_sigma * root_period), 1.0, 0.2);
    EXPECT_NEAR(platform.suite.imu.accelerometer_noise_density / (accelerometer_sigma * root_period), 1.0, 0.2);
    ASSERT_EQ(platform.suite.magnetometers.size(), 2U);
    for (std::size_t j = 0; j < 2; ++j) {
      EXPECT_EQ(platform.magnetometers[j].topic, "/magnetometer_" + std::to_string(j) + "/field");
      EXPECT_NEAR(platform.suite.magnetometers[j].noise_ut / field_sigma_ut, 1.0, 0.2);
    }
    EXPECT_NE(platform.suite.magnetometers[0].name, platform.suite.magnetometers[1].name);
  }

  void expect_mounted(const Platform& platform) {
    const Pose T_imu_lidar = base_imu.inverse() * base_lidar;
    EXPECT_LT(platform.suite.lidar.T_imu_lidar.boxminus(T_imu_lidar).norm(), 1e-9);
    EXPECT_LT(platform.suite.magnetometers[0].T_imu_mag.boxminus(T_imu_lidar * lidar_mag).norm(), 1e-9);
    EXPECT_EQ(platform.suite.magnetometers[1].T_imu_mag.boxminus(Pose{}).norm(), 0.0);
  }

  testing::TemporaryFolder folder_;
};

TEST_F(PlatformDraftTest, DescribesARobotOfRos1) {
  write(noisy_robot(), "log.bag");
  const CommentedPlatform commented = draft({"log.bag"});
  const Platform platform = loaded(commented);
  expect_robot(platform);
  EXPECT_EQ(platform.imu.acceleration_unit, AccelerationUnit::metres_per_second_squared);
  EXPECT_EQ(platform.magnetometers[0].unit, FieldUnit::tesla);
  EXPECT_THAT(commented.comments.at("lidar.T_imu_lidar"), StartsWith("guess: identity"));
  CheckCall call;
  call.log = folder_ / "log.bag";
  call.platform = folder_ / "robot.yaml";
  EXPECT_FALSE(has_error(check_log(call).findings));
}

TEST_F(PlatformDraftTest, MountsTheSensorsByStaticTransformsOfRos1) {
  write(noisy_robot(), "log.bag");
  ros1::BagWriter writer(folder_ / "tf.bag", Codec::none);
  Ros1WireWriter wire;
  wire.number(static_cast<std::uint32_t>(edges.size()));
  for (const Edge& edge : edges) {
    wire.header(0, edge.parent);
    wire.text(edge.child);
    for (const double value : edge.pose.position) wire.number(value);
    for (const double value : edge.pose.rotation.coeffs()) wire.number(value);
  }
  const std::vector<std::uint8_t> bytes = wire.take();
  writer.write({"/tf_static", "tf2_msgs/TFMessage", Encoding::ros1, 0, 0, 0, "94810edda583a504dfda3829e70d7eec", ""},
               {SyntheticLog{}.start, 0, bytes.data(), bytes.size()});
  writer.close();
  const CommentedPlatform commented = draft({"log.bag", "tf.bag"});
  expect_mounted(loaded(commented));
  EXPECT_THAT(commented.comments.at("lidar.T_imu_lidar"), HasSubstr("from /tf_static, 'imu_link' to 'laser'"));
  EXPECT_THAT(commented.comments.at("magnetometers[1].T_imu_mag"),
              AllOf(StartsWith("guess"), HasSubstr("does not connect 'imu_link' with 'mag_1'")));
}

TEST_F(PlatformDraftTest, DescribesARobotOfRos2) {
  write(noisy_robot(), "log.bag");
  WarningLog warnings;
  const auto source = open_log(folder_ / "log.bag", warnings);
  const auto writer = make_log_writer(folder_ / "log.mcap", LogFormat::mcap, Codec::zstd);
  const TopicInfo tf = result_topic("/tf_static", "tf2_msgs/TFMessage");
  for (const Edge& edge : edges) {
    const auto bytes = transform_message(SyntheticLog{}.start, edge.parent, edge.child, edge.pose);
    writer->write(tf, {SyntheticLog{}.start, 0, bytes.data(), bytes.size()});
  }
  convert_log(folder_ / "log.bag", *source, *writer, [](Time) {});
  writer->close();
  const Platform platform = loaded(draft({"log.mcap"}));
  expect_robot(platform);
  expect_mounted(platform);
}

TEST_F(PlatformDraftTest, InfersUnits) {
  struct Case {
    FieldUnit unit;
    double in_tesla;
  };
  for (const Case& each : {Case{FieldUnit::microtesla, 1e-6}, Case{FieldUnit::nanotesla, 1e-9},
                           Case{FieldUnit::gauss, 1e-4}, Case{FieldUnit::milligauss, 1e-7}}) {
    write(noisy_robot(9.80665, each.in_tesla), "log.bag");
    const Platform platform = loaded(draft({"log.bag"}));
    expect_robot(platform);
    EXPECT_EQ(platform.imu.acceleration_unit, AccelerationUnit::standard_gravity);
    EXPECT_EQ(platform.magnetometers[0].unit, each.unit);
    EXPECT_EQ(platform.magnetometers[1].unit, each.unit);
  }
}

TEST_F(PlatformDraftTest, WithoutAStandstillTheNoiseIsAGuess) {
  SyntheticLog log = noisy_robot();
  log.on_imu = [](int i, ros1::ImuMessage& imu) {
    imu.angular_velocity[2] = 0.5 * std::sin(0.02 * i);
    imu.linear_acceleration[0] = 2.0 * std::cos(0.03 * i);
    return true;
  };
  write(log, "log.bag");
  const CommentedPlatform commented = draft({"log.bag"});
  const Platform platform = loaded(commented);
  EXPECT_NEAR(platform.suite.imu.gyroscope_noise_density, 2.618e-4, 1e-7);
  EXPECT_NEAR(platform.suite.imu.accelerometer_noise_density, 2.256e-3, 1e-6);
  EXPECT_THAT(commented.comments.at("imu.gyroscope_noise_density_rad_s_sqrt_hz"),
              AllOf(StartsWith("guess: no standstill"), HasSubstr("ICM-20948")));
  EXPECT_THAT(commented.comments.at("magnetometers[0].noise_ut"), StartsWith("guess: no standstill"));
}

/// A depth camera has more points, but no times. Its log is a second one.
TEST_F(PlatformDraftTest, ChoosesTheLidarWithTimesAndNamesTheOther) {
  write(noisy_robot(), "log.bag");
  ros1::BagWriter writer(folder_ / "camera.bag", Codec::none);
  ros1::PointCloudMessage cloud;
  cloud.frame = "camera";
  cloud.fields = {{"x", 0, 7, 1}, {"y", 4, 7, 1}, {"z", 8, 7, 1}};
  cloud.point_step = 12;
  cloud.width = 5000;
  cloud.row_step = cloud.width * cloud.point_step;
  std::vector<float> points(3 * cloud.width);
  std::iota(points.begin(), points.end(), 1.0F);
  cloud.data = reinterpret_cast<const std::uint8_t*>(points.data());
  cloud.data_size = cloud.row_step;
  for (int i = 0; i < 60; ++i) {
    cloud.stamp = SyntheticLog{}.start + i * SyntheticLog::period;
    writer.write("/camera/points", cloud.stamp, cloud);
  }
  writer.close();
  const CommentedPlatform both = draft({"log.bag", "camera.bag"});
  expect_robot(loaded(both));
  EXPECT_THAT(both.comments.at("lidar.topic"), HasSubstr("others in the log: /camera/points"));

  SyntheticLog blind = noisy_robot();
  blind.lidar = false;
  write(blind, "blind.bag");
  const CommentedPlatform camera = draft({"blind.bag", "camera.bag"});
  EXPECT_EQ(loaded(camera).lidar.topic, "/camera/points");
  EXPECT_EQ(camera.platform.lidar.point_times, PointTimes::none);
}

/// Livox' CustomMsg describes itself, and its driver gives the acceleration in g.
TEST_F(PlatformDraftTest, ALivoxNeedsNoFields) {
  SyntheticLog log = noisy_robot(9.80665);
  log.lidar = false;
  write(log, "imu.bag");
  constexpr std::uint32_t points = 2000;
  std::vector<std::uint8_t> data(points * ros1::LivoxMessage::point_step);
  for (std::uint32_t i = 0; i < points; ++i) {
    std::uint8_t* point = data.data() + i * ros1::LivoxMessage::point_step;
    const std::uint32_t offset_ns = 49'000 * i;
    const float position[3] = {5.0F, 0.001F * static_cast<float>(i), 1.0F};
    std::memcpy(point, &offset_ns, 4);
    std::memcpy(point + 4, position, 12);
  }
  ros1::LivoxMessage scan;
  scan.frame = "livox_frame";
  scan.point_count = points;
  scan.data = data.data();
  scan.data_size = data.size();
  ros1::BagWriter writer(folder_ / "livox.bag", Codec::none);
  for (int i = 0; i < 60; ++i) {
    scan.stamp = SyntheticLog{}.start + i * SyntheticLog::period;
    writer.write("/livox/lidar", scan.stamp + SyntheticLog::period, scan);
  }
  writer.close();
  const CommentedPlatform commented = draft({"livox.bag", "imu.bag"});
  const Platform platform = loaded(commented);
  EXPECT_EQ(platform.lidar.topic, "/livox/lidar");
  EXPECT_EQ(platform.lidar.point_times, PointTimes::field);
  EXPECT_EQ(platform.lidar.time_field, "");
  EXPECT_FALSE(platform.lidar.time_unit);
  EXPECT_EQ(platform.lidar.stamp, ScanStamp::start);
  EXPECT_NEAR(platform.suite.lidar.scan_period_s, 0.1, 1e-6);
  EXPECT_EQ(platform.imu.acceleration_unit, AccelerationUnit::standard_gravity);
  EXPECT_THAT(commented.comments.at("lidar.topic"), HasSubstr("livox_ros_driver2/CustomMsg, frame 'livox_frame'"));
}

TEST_F(PlatformDraftTest, NamesOdometryThatMayBeThatOfWheels) {
  SyntheticLog log = noisy_robot();
  log.on_wheels = [](int, ros1::OdometryMessage&) { return true; };
  write(log, "log.bag");
  const CommentedPlatform commented = draft({"log.bag"});
  expect_robot(loaded(commented));
  EXPECT_THAT(commented.comments.at("name"), StartsWith("not read: /odom;"));
}

TEST_F(PlatformDraftTest, EveryInferredOrGuessedLineHasAComment) {
  write(noisy_robot(), "log.bag");
  std::istringstream lines(commented_text(draft({"log.bag"})));
  for (std::string line; std::getline(lines, line);) {
    const std::string key = line.substr(0, line.find(':'));
    const bool plain = key == "name" || key == "lidar" || key == "imu" || key == "magnetometers" ||
                       key.ends_with("name") || key.ends_with("translation_m") || key.ends_with("quaternion_xyzw") ||
                       key.starts_with("    time") || key.starts_with("  - ") ||
                       key.find("_sigma") != std::string::npos || key.starts_with("    intensity") ||
                       key.starts_with("    ring");
    if (!plain) {
      EXPECT_THAT(line, HasSubstr("  # "));
    }
  }
}

TEST_F(PlatformDraftTest, NamesOfALogCannotBreakTheFile) {
  SyntheticLog log = noisy_robot();
  log.on_scan = [](int, ros1::PointCloudMessage& cloud, std::vector<std::uint8_t>&) {
    cloud.frame = "laser'\nname: other # \"";
    return true;
  };
  write(log, "log.bag");
  expect_robot(loaded(draft({"log.bag"})));
}

TEST_F(PlatformDraftTest, ARobotWithMagnetometersNeedsNoLidar) {
  SyntheticLog blind = noisy_robot();
  blind.lidar = false;
  write(blind, "log.bag");
  const CommentedPlatform drafted = draft({"log.bag"});
  const Platform platform = loaded(drafted);
  EXPECT_FALSE(platform.has_lidar());
  EXPECT_EQ(platform.magnetometers.size(), 2U);
  EXPECT_THAT(drafted.comments.at("imu"), HasSubstr("no LiDAR: these logs have none"));
}

// Its LiDAR is there, but in packets that only its driver can read.
TEST_F(PlatformDraftTest, PacketsOfALidarAreRefusedWithTheTopics) {
  SyntheticLog blind = noisy_robot();
  blind.lidar = false;
  write(blind, "log.bag");
  write_undecodable("packets.bag", "/velodyne_packets", "velodyne_msgs/VelodyneScan", std::string(32, '0'),
                    "uint8 data");
  EXPECT_THAT(testing::message_of<InputError>([&]() {
                draft({"log.bag", "packets.bag"});
              }),
              AllOf(HasSubstr("there is no topic of a LiDAR"), HasSubstr("record the LiDAR's points, not its packets"),
                    HasSubstr("/imu/data (sensor_msgs/Imu, "),
                    HasSubstr("/magnetometer_1/field (sensor_msgs/MagneticField, ")));
}

TEST_F(PlatformDraftTest, MagnetometersThatCannotBeReadAreNamedWithTheReason) {
  write_undecodable("broken.bag", "/magnetometer_2/field", "sensor_msgs/MagneticField",
                    "2f3b0b43eed0c9501de0fa3ff89a45aa", "Header header");
  write(noisy_robot(), "log.bag");
  const CommentedPlatform some = draft({"log.bag", "broken.bag"});
  expect_robot(loaded(some));
  const auto named = HasSubstr("topic /magnetometer_2/field, recorded at ");
  EXPECT_THAT(some.comments.at("magnetometers"), AllOf(StartsWith("not read: "), named));
  EXPECT_THAT(commented_text(some), named);
  SyntheticLog bare = noisy_robot();
  bare.on_field = [](int, int, ros1::MagneticFieldMessage&) { return false; };
  write(bare, "log.bag");
  const CommentedPlatform none = draft({"log.bag", "broken.bag"});
  EXPECT_TRUE(loaded(none).magnetometers.empty());
  EXPECT_THAT(none.comments.at("magnetometers"), AllOf(StartsWith("not read: "), named));
  bare.lidar = false;
  write(bare, "log.bag");
  EXPECT_THAT(testing::message_of<InputError>([&]() {
                draft({"log.bag", "broken.bag"});
              }),
              AllOf(HasSubstr("there is no topic of a LiDAR"), named));
}

TEST_F(PlatformDraftTest, ALogWithoutALidarOrAnImuIsRefusedWithItsTopics) {
  SyntheticLog blind = noisy_robot();
  blind.lidar = false;
  blind.on_field = [](int, int, ros1::MagneticFieldMessage&) { return false; };
  write(blind, "log.bag");
  EXPECT_THAT(testing::message_of<InputError>([&]() { draft({"log.bag"}); }),
              AllOf(HasSubstr("log.bag: there is no topic of a LiDAR"), HasSubstr("/imu/data (sensor_msgs/Imu, ")));
  SyntheticLog floating = noisy_robot();
  floating.on_imu = [](int, ros1::ImuMessage&) { return false; };
  write(floating, "log.bag");
  EXPECT_THAT(testing::message_of<InputError>([&]() { draft({"log.bag"}); }),
              AllOf(HasSubstr("there is no topic of an IMU"), HasSubstr("/ouster/points (sensor_msgs/PointCloud2, ")));
  write_undecodable("broken.bag", "/imu/broken", "sensor_msgs/Imu", "6a62c6daae103f4ff57a132d6f95cec2",
                    "Header header");
  EXPECT_THAT(testing::message_of<InputError>([&]() {
                draft({"log.bag", "broken.bag"});
              }),
              AllOf(HasSubstr("there is no topic of an IMU that can be read (sensor_msgs/Imu); "),
                    HasSubstr("topic /imu/broken, recorded at ")));
}

}  // namespace
}  // namespace lodestone

#include "frontends/synchronizer/bag_source.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "frontends/messages/bag_streams.h"
#include "tests/frontends/logs/log_contents.h"
#include "tests/frontends/logs/synthetic_log.h"
#include "tests/frontends/logs/test_files.h"

namespace lodestone {
namespace {

using ::lodestone::testing::Contents;
using ::lodestone::testing::first_field;
using ::lodestone::testing::message_of;
using ::lodestone::testing::read_all;
using ::lodestone::testing::SyntheticLog;
using ::lodestone::testing::TemporaryFolder;
using ::testing::AllOf;
using ::testing::ContainsRegex;
using ::testing::HasSubstr;

class BagSourceTest : public ::testing::Test {
 protected:
  Contents read() {
    log.write(path);
    return read_all(path, platform());
  }
  std::string error() {
    log.write(path);
    return message_of<InputError>([this] { read_all(path, platform()); });
  }
  Platform platform() {
    Platform result = log.platform();
    if (change_platform) change_platform(result);
    return result;
  }

  TemporaryFolder folder;
  std::string path = folder / "log.bag";
  SyntheticLog log;
  std::function<void(Platform&)> change_platform;
};

TEST_F(BagSourceTest, GivesEveryMeasurementInItsUnit) {
  const Contents contents = read();
  ASSERT_EQ(contents.scans.size(), 20U);
  const LidarScan& scan = contents.scans[3];
  EXPECT_EQ(scan.start, log.start + 3 * SyntheticLog::period);
  ASSERT_EQ(scan.points.size(), 2048U);
  EXPECT_EQ(scan.points[100].position, Eigen::Vector3f(10.1F, -2.0F, 1.0F));
  EXPECT_EQ(scan.points[101].intensity, 1.0F);
  EXPECT_EQ(scan.points[37].ring, 5);
  EXPECT_EQ(scan.points[2].offset_ns, SyntheticLog::period / 2048 * 2);
  EXPECT_EQ(scan.end, scan.start + SyntheticLog::period / 2048 * 2047);
  EXPECT_EQ(contents.imu.size(), 405U);
  EXPECT_EQ(contents.imu[7].time, log.start + 33'000'000);
  EXPECT_EQ(contents.imu[7].linear_acceleration.z(), 9.80665);
  EXPECT_EQ(contents.fields.size(), 2U * 203U);
  EXPECT_NEAR((first_field(contents, 1) - Vector3(20.0, 1.0, -40.0)).norm(), 0.0, 1e-12);
  EXPECT_TRUE(contents.warnings.entries().empty());
  EXPECT_EQ(contents.begin, contents.imu.front().time);
  EXPECT_EQ(contents.end, contents.fields.back().time);
}

TEST_F(BagSourceTest, TheCalibrationOfAMagnetometerIsTakenOff) {
  log.write(path);
  Platform calibrated = log.platform();
  calibrated.magnetometers[1].hard_iron_ut = Vector3(5.0, -3.0, 8.0);
  calibrated.magnetometers[1].soft_iron_correction << 1.02, 0.1, 0.0, -0.02, 0.99, 0.01, 0.0, 0.03, 1.0;
  const Contents before = read_all(path, log.platform());
  const Contents after = read_all(path, calibrated);
  EXPECT_EQ(first_field(after, 0), first_field(before, 0));
  const MagnetometerMessageLayout& layout = calibrated.magnetometers[1];
  EXPECT_LT(
      (first_field(after, 1) - layout.soft_iron_correction * (first_field(before, 1) - layout.hard_iron_ut)).norm(),
      1e-12);
}

TEST_F(BagSourceTest, MissingAndCutOffFiles) {
  EXPECT_THAT(message_of<InputError>([this] { read_all(folder / "absent.bag", platform()); }),
              HasSubstr("absent.bag: there is no such file"));
  log.compression = Codec::none;
  log.write(path);
  const Contents whole = read_all(path, platform());
  std::filesystem::resize_file(path, std::filesystem::file_size(path) / 2);
  const Contents half = read_all(path, platform());
  EXPECT_EQ(half.warnings.count("log.cut_off"), 1);
  EXPECT_NEAR(static_cast<double>(half.scans.size()), 10.0, 3.0);
  ASSERT_GT(half.imu.size(), 100U);
  ASSERT_LT(half.imu.size(), whole.imu.size());
  for (std::size_t i = 0; i < half.imu.size(); ++i) EXPECT_EQ(half.imu[i].time, whole.imu[i].time);
  std::filesystem::resize_file(path, 4200);
  EXPECT_THAT(message_of<InputError>([this] { read_all(path, platform()); }), HasSubstr("no message before"));
}

TEST_F(BagSourceTest, ATopicThatIsNotThereIsNamedWithThoseThatAre) {
  change_platform = [](Platform& platform) { platform.lidar.topic = "/ouster/point"; };
  EXPECT_THAT(error(), AllOf(HasSubstr("there is no topic /ouster/point;"), HasSubstr("did you mean /ouster/points?"),
                             HasSubstr("set lidar.topic in platform.yaml"), HasSubstr("/imu/data (sensor_msgs/Imu)")));
  change_platform = [](Platform& platform) { platform.imu.topic = "/ouster/points"; };
  EXPECT_THAT(error(), HasSubstr("topic /ouster/points is a sensor_msgs/PointCloud2; expected a sensor_msgs/Imu"));
  change_platform = nullptr;
  log.lidar = false;
  EXPECT_THAT(error(), HasSubstr("the log has no sensor_msgs/PointCloud2"));
  EXPECT_EQ(read_all(path, platform(), {.lidar = false}).imu.size(), 405U) << "a run without LiDAR does not need it";
}

TEST_F(BagSourceTest, ACloudWithoutPointTimeIsRefused) {
  log.on_scan = [](int, ros1::PointCloudMessage& cloud, auto&) {
    cloud.fields.erase(cloud.fields.begin() + 4);
    return true;
  };
  EXPECT_THAT(error(), AllOf(HasSubstr("there is no point field 't'"), HasSubstr("x, y, z, intensity, ring"),
                             HasSubstr("lidar.fields.time")));
}

TEST_F(BagSourceTest, AWrongUnitOfThePointTimeIsRefused) {
  change_platform = [](Platform& platform) { platform.lidar.time_unit = PointTimeUnit::microseconds; };
  EXPECT_THAT(error(), AllOf(HasSubstr("span 100 s"), HasSubstr("lidar.time_unit")));
  change_platform = nullptr;
  log.on_scan = [](int, ros1::PointCloudMessage&, std::vector<std::uint8_t>& data) {
    for (int i = 0; i < 2048; ++i) std::memset(data.data() + i * 32 + 20, 0, 4);
    return true;
  };
  EXPECT_THAT(error(), HasSubstr("span 0 s"));
}

TEST_F(BagSourceTest, ATruncatedCloudAndAWrongDatatypeAreRefused) {
  log.on_scan = [](int scan, ros1::PointCloudMessage&, std::vector<std::uint8_t>& data) {
    if (scan == 4) data.resize(1000);
    return true;
  };
  EXPECT_THAT(error(), HasSubstr("has 1000 bytes of data; expected 65536"));
  log.on_scan = [](int, ros1::PointCloudMessage& cloud, auto&) {
    cloud.fields[1].datatype = ros1::PointField::int32;
    return true;
  };
  EXPECT_THAT(error(), HasSubstr("'y' has the datatype 5"));
  log.on_scan = [](int, ros1::PointCloudMessage& cloud, auto&) {
    cloud.fields[5].offset = 31;
    return true;
  };
  EXPECT_THAT(error(), HasSubstr("'ring' ends beyond the point's 32 bytes"));
}

TEST_F(BagSourceTest, NanPointsAreDroppedAndCounted) {
  log.on_scan = [](int scan, ros1::PointCloudMessage&, std::vector<std::uint8_t>& data) {
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const float none[3] = {0.0F, 0.0F, 0.0F};
    if (scan == 2) SyntheticLog::put(data, 10, 4, &nan, 4);
    if (scan == 2) SyntheticLog::put(data, 11, 0, none, 12);
    return true;
  };
  const Contents contents = read();
  EXPECT_EQ(contents.scans[2].points.size(), 2046U);
  EXPECT_EQ(contents.scans[2].points[10].position.x(), 10.0F + 0.001F * 12.0F);
  EXPECT_EQ(contents.scans[2].points[10].offset_ns, SyntheticLog::period / 2048 * 12);
  EXPECT_EQ(contents.warnings.count("lidar.nan_points"), 1);
}

TEST_F(BagSourceTest, AnEmptyScanIsCountedAndKeepsItsTime) {
  log.on_scan = [](int scan, ros1::PointCloudMessage& cloud, std::vector<std::uint8_t>& data) {
    if (scan != 5) return true;
    cloud.width = 0;
    data.clear();
    return true;
  };
  const Contents contents = read();
  ASSERT_EQ(contents.scans.size(), 20U);
  EXPECT_TRUE(contents.scans[5].points.empty());
  EXPECT_EQ(contents.scans[5].end - contents.scans[5].start, SyntheticLog::period);
  EXPECT_EQ(contents.warnings.count("lidar.empty_scan"), 1);
}

TEST_F(BagSourceTest, AnImuInGIsRefusedUnlessThePlatformSaysSo) {
  log.on_imu = [](int, ros1::ImuMessage& imu) {
    imu.linear_acceleration = {0.0, 0.02, 1.0};
    return true;
  };
  EXPECT_THAT(error(), AllOf(HasSubstr("/imu/data"), HasSubstr("IMU is in g: set imu.acceleration_unit: g")));
  change_platform = [](Platform& platform) { platform.imu.acceleration_unit = AccelerationUnit::standard_gravity; };
  EXPECT_NEAR(read().imu[0].linear_acceleration.z(), 9.80665, 1e-12);
  log.on_imu = nullptr;
  EXPECT_THAT(error(), HasSubstr("set imu.acceleration_unit: m/s2"));
  change_platform = nullptr;
  log.on_imu = [](int, ros1::ImuMessage& imu) {
    imu.linear_acceleration = {0.0, 0.02, 0.01};
    return true;
  };
  EXPECT_THAT(error(), HasSubstr("expected the specific force including gravity, about 9.807 (gravity_m_s2); check "
                                 "imu.acceleration_unit and gravity_m_s2 in platform.yaml"));
}

TEST_F(BagSourceTest, AMagnetometerInMicroteslaIsRefusedUnlessThePlatformSaysSo) {
  log.on_field = [](int, int magnetometer, ros1::MagneticFieldMessage& field) {
    if (magnetometer == 1) field.field_tesla = {20.0, 1.0, -40.0};
    return true;
  };
  EXPECT_THAT(error(), AllOf(HasSubstr("/magnetometer_1/field"), HasSubstr("44.73 tesla"),
                             HasSubstr("set magnetometers[1].unit: microtesla in platform.yaml")));
  change_platform = [](Platform& platform) { platform.magnetometers[1].unit = FieldUnit::microtesla; };
  EXPECT_EQ(first_field(read(), 1), Vector3(20.0, 1.0, -40.0));
}

TEST_F(BagSourceTest, AFieldBeyondTheEarthsInAnyUnitIsCounted) {
  for (const double factor : {0.01, 8.0}) {
    log.on_field = [factor](int, int, ros1::MagneticFieldMessage& field) {
      for (double& component : field.field_tesla) component *= factor;
      return true;
    };
    EXPECT_EQ(read().warnings.count("magnetometer.magnitude"), 2) << factor;
  }
}

TEST_F(BagSourceTest, AMagnetometerInTeslaIsRefusedWhereThePlatformSaysMicrotesla) {
  change_platform = [](Platform& platform) { platform.magnetometers[1].unit = FieldUnit::microtesla; };
  EXPECT_THAT(error(), AllOf(HasSubstr("set magnetometers[1].unit: tesla in platform.yaml"),
                             ContainsRegex("magnitude is [0-9.e-]+ microtesla; expected")));
}

TEST_F(BagSourceTest, AnImuGapIsCounted) {
  log.on_imu = [](int i, ros1::ImuMessage&) { return i < 100 || i >= 130; };
  const Contents contents = read();
  EXPECT_EQ(contents.warnings.count("imu.gap"), 1);
  EXPECT_THAT(contents.warnings.entries().at("imu.gap").first_detail, HasSubstr("0.155 s without a sample"));
}

TEST_F(BagSourceTest, StampsThatGoBackAreDroppedAndCounted) {
  log.on_imu = [](int i, ros1::ImuMessage& imu) {
    if (i == 50) imu.stamp -= 20'000'000;
    if (i == 60) imu.stamp -= SyntheticLog::imu_period;
    return true;
  };
  log.on_scan = [](int scan, ros1::PointCloudMessage& cloud, auto&) {
    if (scan == 7) cloud.stamp -= 3 * SyntheticLog::period;
    return true;
  };
  log.on_field = [](int i, int magnetometer, ros1::MagneticFieldMessage& field) {
    if (i == 9 && magnetometer == 0) field.stamp -= 2 * SyntheticLog::field_period;
    return true;
  };
  const Contents contents = read();
  EXPECT_EQ(contents.imu.size(), 403U);
  EXPECT_EQ(contents.scans.size(), 19U);
  EXPECT_EQ(contents.warnings.count("imu.stamp_back"), 1);
  EXPECT_EQ(contents.warnings.count("imu.stamp_repeated"), 1);
  EXPECT_EQ(contents.warnings.count("lidar.stamp_back"), 1);
  EXPECT_EQ(contents.warnings.count("magnetometer.stamp_back"), 1);
  for (std::size_t i = 1; i < contents.imu.size(); ++i) EXPECT_GT(contents.imu[i].time, contents.imu[i - 1].time);
}

TEST_F(BagSourceTest, OneStampInTheFarFutureDoesNotSpoilTheRest) {
  log.on_imu = [](int i, ros1::ImuMessage& imu) {
    if (i == 50) imu.stamp += 3'600'000'000'000;
    return true;
  };
  const Contents contents = read();
  EXPECT_EQ(contents.imu.size(), 404U);
  EXPECT_EQ(contents.warnings.count("imu.stamp_jump"), 1);
}

TEST_F(BagSourceTest, AFirstMessageThatWasRecordedOddlyDoesNotSpoilTheRest) {
  for (const Time early : {Time{11'000'000'000}, log.start - 1'000'000'000}) {
    log.on_record = [this, early](Time time) { return time < log.start ? time - early : time; };
    const Contents contents = read();
    EXPECT_EQ(contents.imu.size() + static_cast<std::size_t>(contents.warnings.count("imu.stamp_jump")), 405U);
    EXPECT_LE(contents.warnings.count("imu.stamp_jump"), 1);
    EXPECT_EQ(contents.scans.size(), 20U);
  }
}

TEST_F(BagSourceTest, WhereTheRecordersClockAloneLeapsTheStampsAreTaken) {
  log.on_record = [this](Time time) { return time < log.start + 1'000'000'000 ? time : time + 3'600'000'000'000; };
  const Contents contents = read();
  EXPECT_EQ(contents.imu.size(), 405U);
  EXPECT_EQ(contents.scans.size(), 20U);
  EXPECT_EQ(contents.fields.size(), 2U * 203U);
  EXPECT_GT(contents.warnings.count("log.recorder_clock"), 0);
  EXPECT_LE(contents.warnings.count("log.recorder_clock"), 4) << "once of a stream";
}

TEST_F(BagSourceTest, TwoDrivesInOneLogEndWithTheFirst) {
  const Time second = log.start + 1'000'000'000;
  const auto later = [second](Time time) { return time < second ? time : time + 3'600'000'000'000; };
  log.on_record = later;
  log.on_imu = [later](int, ros1::ImuMessage& imu) { return imu.stamp = later(imu.stamp), true; };
  log.on_field = [later](int, int, ros1::MagneticFieldMessage& field) {
    return field.stamp = later(field.stamp), true;
  };
  log.on_scan = [later](int, ros1::PointCloudMessage& cloud, std::vector<std::uint8_t>&) {
    return cloud.stamp = later(cloud.stamp), true;
  };
  const Contents contents = read();
  EXPECT_NEAR(static_cast<double>(contents.imu.size()), 200.0, 2.0);
  EXPECT_LT(contents.imu.back().time, second);
  EXPECT_EQ(contents.warnings.count("log.broken_off"), 1);
  EXPECT_THAT(contents.warnings.entries().at("log.broken_off").first_detail, HasSubstr("--to 3601, and --from 3601"));

  WarningLog warnings;
  BagSource bridged(path, platform(), warnings, {}, LogPause::is_bridged);
  int imu = 0;
  Time last = 0;
  for (Measurement measurement; bridged.next(measurement); last = completion_time(measurement)) {
    if (std::holds_alternative<ImuSample>(measurement)) ++imu;
  }
  EXPECT_EQ(imu, 405);
  EXPECT_GT(last, later(second));
  EXPECT_EQ(warnings.count("log.broken_off"), 0);
}

TEST_F(BagSourceTest, ASilentTopicIsNamed) {
  SensorStream stream;
  stream.sensor = Sensor::imu;
  stream.topic = "/imu/data";
  stream.key = "imu.topic";
  TopicInfo topic;
  topic.name = "/imu/data";
  topic.type = "sensor_msgs/Imu";
  std::vector<SensorStream> streams{stream};
  const std::string message = message_of<InputError>([&] { find_topics("log.db3", log.platform(), {topic}, streams); });
  EXPECT_THAT(message, AllOf(HasSubstr("topic /imu/data has no messages"), HasSubstr("imu.topic")));
}

TEST_F(BagSourceTest, SamplesThatAreNotFiniteAreDroppedAndCounted) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  log.on_imu = [nan](int i, ros1::ImuMessage& imu) {
    if (i == 300) imu.angular_velocity[1] = nan;
    return true;
  };
  log.on_field = [nan](int i, int, ros1::MagneticFieldMessage& field) {
    if (i == 150) field.field_tesla[0] = nan;
    return true;
  };
  const Contents contents = read();
  EXPECT_EQ(contents.warnings.count("imu.not_finite"), 1);
  EXPECT_EQ(contents.warnings.count("magnetometer.not_finite"), 2);
}

TEST_F(BagSourceTest, ClocksThatDifferAreRefused) {
  log.on_imu = [](int, ros1::ImuMessage& imu) {
    imu.stamp -= 1'600'000'000'000'000'000;
    return true;
  };
  EXPECT_THAT(error(), HasSubstr("clocks differ"));
  log.on_imu = [](int, ros1::ImuMessage& imu) {
    imu.stamp = 0;
    return true;
  };
  EXPECT_THAT(error(), HasSubstr("have no stamp"));
}

TEST_F(BagSourceTest, ScanStampsAtTheEndAndAbsolutePointTimesMeanTheSame) {
  const Contents expected = read();
  change_platform = [](Platform& platform) { platform.lidar.stamp = ScanStamp::end; };
  log.on_scan = [](int, ros1::PointCloudMessage& cloud, auto&) {
    cloud.stamp += SyntheticLog::period / 2048 * 2047;
    return true;
  };
  const Contents at_end = read();
  EXPECT_EQ(at_end.scans[3].start, expected.scans[3].start);
  EXPECT_EQ(at_end.scans[3].end, expected.scans[3].end);

  // Seconds since 1970 in a double, as written by Velodyne and Hesai drivers: exact to a quarter of a microsecond.
  log.on_scan = [](int, ros1::PointCloudMessage& cloud, std::vector<std::uint8_t>& data) {
    cloud.fields[4] = {"t", 24, ros1::PointField::float64, 1};
    cloud.fields.pop_back();
    for (int i = 0; i < 2048; ++i) {
      const double time =
          static_cast<double>(cloud.stamp) * 1e-9 + 1e-9 * static_cast<double>(SyntheticLog::period / 2048 * i);
      SyntheticLog::put(data, i, 24, &time, 8);
    }
    return true;
  };
  change_platform = [](Platform& platform) {
    platform.lidar.time_unit = PointTimeUnit::seconds;
    platform.lidar.ring_field.clear();
  };
  const Contents absolute = read();
  EXPECT_NEAR(static_cast<double>(absolute.scans[3].start - expected.scans[3].start), 0.0, 300.0);
  EXPECT_NEAR(absolute.scans[3].points[99].offset_ns, expected.scans[3].points[99].offset_ns, 600.0);
}

}  // namespace
}  // namespace lodestone

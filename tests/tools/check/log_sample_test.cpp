// The checks use the same measurements as a run: sensors in messages of any type, calibrations, several LiDARs.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "frontends/messages/stream_decoder.h"
#include "frontends/messages/wire_ros1.h"
#include "frontends/synchronizer/bag_source.h"
#include "tests/frontends/logs/synthetic_log.h"
#include "tests/frontends/logs/test_files.h"
#include "tools/check/log_checks.h"

namespace lodestone {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::SyntheticLog;

/// A log with the synthetic IMU and scans, and two magnetometers in one list of numbers without a header.
class LogSampleTest : public ::testing::Test {
 protected:
  void SetUp() override {
    TopicInfo array{"/array", "std_msgs/Float64MultiArray", Encoding::ros1, 0, 0, 0, "4b7d974086d4060e7db4613a7e6c3ba4",
                    ""};
    SyntheticLog log;
    log.on_imu = [](int, ros1::ImuMessage& imu) {
      imu.angular_velocity = {};
      return true;
    };
    ros1::BagWriter writer(path_, Codec::none);
    for (int i = 0; i < 400; ++i) {
      const Time time = log.start + i * SyntheticLog::imu_period;
      log.write_imu(writer, i);
      Ros1WireWriter wire;
      wire.number(std::uint32_t{0});  // dimensions
      wire.number(std::uint32_t{0});  // data_offset
      wire.number(std::uint32_t{6});
      for (int k = 0; k < 6; ++k) wire.number(1e-6 * (10.0 * k + std::sin(12.9898 * i + 78.2 * k)));
      const std::vector<std::uint8_t> bytes = wire.take();
      writer.write(array, {time, 0, bytes.data(), bytes.size()});
      if (i % 20 == 0) log.write_scan(writer, i / 20);
    }
    writer.close();
    platform_ = SyntheticLog{}.platform();
    platform_.magnetometers[0].topic = platform_.magnetometers[1].topic = "/array";
    platform_.magnetometers[0].path = "data[0]";
    platform_.magnetometers[1].path = "data[3]";
    platform_.magnetometers[1].hard_iron_ut = {5.0, -3.0, 8.0};
    platform_.magnetometers[1].soft_iron_correction(0, 1) = 0.1;
    platform_.further_lidars = {platform_.lidar};
    platform_.suite.further_lidars = {platform_.suite.lidar};
  }

  testing::TemporaryFolder folder_;
  std::string path_ = folder_ / "log.bag";
  Platform platform_;
  WarningLog warnings_;
};

TEST_F(LogSampleTest, HoldsWhatARunReads) {
  const LogSample sample = read_log_sample(path_, platform_, 30.0, warnings_);
  std::vector<ImuSample> imu;
  std::vector<std::vector<MagneticSample>> fields(2);
  std::vector<LidarScan> scans;
  BagSource source(path_, platform_, warnings_);
  for (Measurement measurement; source.next(measurement);) {
    if (auto* scan = std::get_if<LidarScan>(&measurement)) scans.push_back(*scan);
    if (auto* one = std::get_if<ImuSample>(&measurement)) imu.push_back(*one);
    if (auto* field = std::get_if<MagneticSample>(&measurement))
      fields[static_cast<std::size_t>(field->magnetometer)].push_back(*field);
  }
  ASSERT_EQ(sample.imu.size(), imu.size());
  for (std::size_t i = 0; i < imu.size(); ++i) {
    EXPECT_EQ(sample.imu[i].time, imu[i].time);
    EXPECT_EQ(sample.imu[i].linear_acceleration, imu[i].linear_acceleration);
  }
  for (std::size_t j = 0; j < 2; ++j) {
    ASSERT_EQ(sample.fields[j].size(), 400U);
    ASSERT_EQ(fields[j].size(), 400U);
    for (std::size_t i = 0; i < 400; ++i) {
      EXPECT_EQ(sample.fields[j][i].time, fields[j][i].time);
      EXPECT_EQ(calibrated(platform_.magnetometers[j], sample.fields[j][i].field_ut), fields[j][i].field_ut);
    }
  }
  EXPECT_NE(sample.fields[1][0].field_ut, fields[1][0].field_ut) << "the unit is inferred from the readings";
  ASSERT_EQ(sample.lidars.size(), 2U);
  for (const LidarSample& lidar : sample.lidars) {
    ASSERT_EQ(lidar.scans.size(), scans.size());
    for (std::size_t i = 0; i < scans.size(); ++i) {
      EXPECT_EQ(lidar.scans[i].start, scans[i].start);
      EXPECT_EQ(lidar.scans[i].end, scans[i].end);
    }
  }
  EXPECT_TRUE(warnings_.entries().empty());
}

TEST_F(LogSampleTest, RaisesNoAlarm) {
  std::vector<std::string> alarms;
  for (const Finding& one : check_sensors(read_log_sample(path_, platform_, 30.0, warnings_), platform_)) {
    if (one.severity != Severity::note && one.kind != "lidar.sparse") alarms.push_back(one.kind + ": " + one.seen);
  }
  EXPECT_THAT(alarms, IsEmpty());
}

TEST_F(LogSampleTest, AWrongPathIsOneFindingAndHindersNoOther) {
  platform_.magnetometers[0].path = "values[0]";
  const LogSample sample = read_log_sample(path_, platform_, 30.0, warnings_);
  std::vector<std::string> errors;
  for (const Finding& one : check_sensors(sample, platform_)) {
    if (one.severity == Severity::error) errors.push_back(one.kind + ": " + one.seen + one.change);
  }
  EXPECT_THAT(errors,
              ElementsAre(AllOf(HasSubstr("topic.message"), HasSubstr("magnetometers[0].values"), HasSubstr("data"))));
  EXPECT_EQ(sample.fields[1].size(), 400U);
}

TEST_F(LogSampleTest, ATopicOfAnotherTypeNeedsAPath) {
  platform_.magnetometers[0].path.clear();
  const Findings findings = check_sensors(read_log_sample(path_, platform_, 30.0, warnings_), platform_);
  ASSERT_FALSE(findings.empty());
  EXPECT_EQ(findings[0].kind, "topic.missing");
  EXPECT_THAT(findings[0].seen, HasSubstr("is a std_msgs/Float64MultiArray"));
  EXPECT_THAT(findings[0].change, HasSubstr("magnetometers[0].values in platform.yaml"));
}

TEST_F(LogSampleTest, AFurtherLidarsMistakesNameItsOwnKeys) {
  platform_.further_lidars[0].time_unit = PointTimeUnit::microseconds;
  const LogSample sample = read_log_sample(path_, platform_, 30.0, warnings_);
  std::vector<std::string> changes;
  for (const Finding& one : check_sensors(sample, platform_)) {
    if (one.kind == "lidar.point_time") changes.push_back(one.change);
  }
  EXPECT_THAT(changes, ElementsAre(HasSubstr("further_lidars[0].fields.time: t, further_lidars[0].time_unit: ns")));
  EXPECT_EQ(sample.scans().size(), 20U);
}

}  // namespace
}  // namespace lodestone

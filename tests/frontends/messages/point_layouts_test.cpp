#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/error.h"
#include "frontends/messages/point_cloud_decoder.h"
#include "tests/frontends/logs/test_files.h"
#include "tests/frontends/messages/cloud_layout.h"
#include "tools/simulate/simulation_source.h"

namespace lodestone {
namespace {

using ::lodestone::testing::CloudLayout;
using ::lodestone::testing::message_of;
using ::testing::AllOf;
using ::testing::HasSubstr;
using Field = ros1::PointField;

/// Three simulated scans of a rotating LiDAR in a hall, at rest and moving; made once.
const std::vector<LidarScan>& simulated_scans() {
  static const std::vector<LidarScan> scans = [] {
    const testing::TemporaryFolder folder;
    const std::string path = folder / "hall.yaml";
    testing::write_text(path,
                        "name: hall\nearth_field_ut: [20, 0, -40]\nstart_time_s: 1700000000\n"
                        "sensors:\n  lidar: {rows: 8, columns: 512, min_range_m: 0.1, max_range_m: 60}\n"
                        "solids:\n  - {name: hall, shape: box, at_m: [0, 0, 1.5], size_m: [20, 12, 3]}\n"
                        "sequences:\n  short: {waypoints_m: [[-4, 0], [4, 0]], speed: [[0, 1.0]]}\n");
    const simulation::World world = simulation::load_world(path);
    simulation::SimulationSource source(world, std::make_shared<simulation::Environment>(world), "short",
                                        simulation::SimulationSource::Drive::sequence, 1, 0.5);
    std::vector<LidarScan> result;
    for (Measurement measurement; source.next(measurement);) {
      if (auto* scan = std::get_if<LidarScan>(&measurement)) result.push_back(std::move(*scan));
    }
    return result;
  }();
  return scans;
}

Platform platform_of(const LidarMessageLayout& layout) {
  Platform platform;
  platform.file = "robot.yaml";
  platform.lidar = layout;
  platform.lidar.topic = "/points";
  return platform;
}

/// A layout without settings, except for the stamp if given.
LidarMessageLayout inferred_layout(std::optional<ScanStamp> stamp) {
  LidarMessageLayout layout;
  layout.stamp = stamp;
  layout.intensity_field.clear();
  layout.ring_field.clear();
  layout.time_field.clear();
  layout.time_unit.reset();
  return layout;
}

/// A layout with all settings.
LidarMessageLayout stated_layout(const CloudLayout& cloud) {
  LidarMessageLayout layout;
  layout.stamp = cloud.stamp;
  layout.time_field = cloud.field;
  layout.time_unit = cloud.unit;
  layout.time_zero = cloud.zero;
  return layout;
}

std::string name_of(const CloudLayout& cloud) {
  PointTimeReading reading{cloud.unit, cloud.zero, cloud.stamp, false};
  return cloud.field + " (" + name_of_datatype(cloud.datatype) + "): " + describe(reading);
}

/// Writes the simulated scans with the layout `cloud`, reads them with `layout`, and compares every point with the
/// original.
void expect_read_back(const CloudLayout& cloud, const LidarMessageLayout& layout, bool warning_expected) {
  SCOPED_TRACE(name_of(cloud));
  WarningLog warnings;
  const Platform platform = platform_of(layout);
  PointCloudDecoder decoder("log.bag", platform, warnings);
  std::vector<std::uint8_t> data;
  for (const LidarScan& scan : simulated_scans()) {
    ASSERT_GT(scan.points.size(), conclusive_points);
    CloudLayout written = cloud;
    if (cloud.zero == PointTimeZero::lidar_clock)
      written.clock_origin = simulated_scans().front().start - 123'456'789'012;
    LidarScan read;
    decoder.decode(written.write(scan, data), read);
    ASSERT_EQ(read.points.size(), scan.points.size());
    const Time largest = cloud.zero == PointTimeZero::epoch         ? scan.end
                         : cloud.zero == PointTimeZero::lidar_clock ? scan.end - written.clock_origin
                                                                    : scan.end - scan.start;
    // Factor two: if the stamp is not that of the start, the last point's time determines the first one's.
    const double tolerance = 2.0 * cloud.quantum_ns(largest) + 2.0;
    double worst = 0.0;
    for (std::size_t i = 0; i < scan.points.size(); ++i) {
      ASSERT_EQ(read.points[i].position, scan.points[i].position);
      ASSERT_EQ(read.points[i].intensity, scan.points[i].intensity);
      ASSERT_EQ(read.points[i].ring, scan.points[i].ring);
      const Time apart = read.start + read.points[i].offset_ns - scan.start - scan.points[i].offset_ns;
      worst = std::max(worst, std::abs(static_cast<double>(apart)));
    }
    EXPECT_LE(worst, tolerance);
    EXPECT_LE(std::abs(static_cast<double>(read.end - scan.end)), tolerance);
  }
  EXPECT_EQ(warnings.count("lidar.told_from_content"), warning_expected ? 1 : 0);
  EXPECT_EQ(warnings.entries().size(), warning_expected ? 1U : 0U);
}

struct Number {
  std::uint8_t datatype;
  PointTimeUnit unit;
  bool as_pair = false;
};

constexpr auto s = PointTimeUnit::seconds, ms = PointTimeUnit::milliseconds, us = PointTimeUnit::microseconds,
               ns = PointTimeUnit::nanoseconds;
constexpr ScanStamp stamps[] = {ScanStamp::start, ScanStamp::middle, ScanStamp::end};

/// Calls `check` for every combination of stamp and number type, with a name for it.
template <class Check>
int cross(PointTimeZero zero, const std::vector<Number>& numbers, const Check& check) {
  const std::string names[] = {"t", "time", "timestamp", "time_stamp", "offset_time", "timeOffset", "point_time", "T"};
  int count = 0;
  for (const ScanStamp stamp : stamps) {
    for (const Number& number : numbers) {
      CloudLayout cloud{names[static_cast<std::size_t>(count++) % std::size(names)],
                        number.datatype,
                        number.unit,
                        zero,
                        stamp,
                        number.as_pair,
                        0};
      check(cloud);
    }
  }
  return count;
}

TEST(PointLayouts, TimesFromTheScansStartInEveryTypeAndUnit) {
  const std::vector<Number> numbers{
      {Field::uint32, ns},  {Field::uint32, us}, {Field::float32, s},  {Field::float32, ms},     {Field::float32, us},
      {Field::float32, ns}, {Field::float64, s}, {Field::float64, ms}, {Field::float64, us},     {Field::float64, ns},
      {Field::uint16, ms},  {Field::uint64, ns}, {Field::int32, us},   {Field::uint64, ns, true}};
  const int count = cross(PointTimeZero::scan_start, numbers, [](const CloudLayout& cloud) {
    expect_read_back(cloud, stated_layout(cloud), false);
    expect_read_back(cloud, inferred_layout(cloud.stamp), true);
    if (cloud.stamp == ScanStamp::start) expect_read_back(cloud, inferred_layout(std::nullopt), true);
  });
  EXPECT_EQ(count, 3 * 14);
}

TEST(PointLayouts, TimesFromTheStampTellItsInstant) {
  const std::vector<Number> numbers{{Field::float32, s}, {Field::float64, s}, {Field::float32, ms},
                                    {Field::int32, ns},  {Field::int32, us},  {Field::float64, ns}};
  cross(PointTimeZero::stamp, numbers, [](const CloudLayout& cloud) {
    expect_read_back(cloud, stated_layout(cloud), false);
    expect_read_back(cloud, inferred_layout(std::nullopt), true);
    // The stamp stated in the platform file cannot affect them.
    if (cloud.stamp != ScanStamp::start) expect_read_back(cloud, inferred_layout(ScanStamp::start), true);
  });
}

TEST(PointLayouts, AbsoluteTimesNeedNoStamp) {
  const std::vector<Number> numbers{{Field::float64, s},      {Field::float64, ms}, {Field::float64, us},
                                    {Field::float64, ns},     {Field::uint64, ns},  {Field::uint64, us},
                                    {Field::uint64, ns, true}};
  cross(PointTimeZero::epoch, numbers, [](const CloudLayout& cloud) {
    expect_read_back(cloud, stated_layout(cloud), false);
    for (const ScanStamp stated_stamp : stamps) expect_read_back(cloud, inferred_layout(stated_stamp), true);
    expect_read_back(cloud, inferred_layout(std::nullopt), true);
  });
}

TEST(PointLayouts, TimesOfTheLidarsOwnClockArePlacedByTheStamp) {
  const std::vector<Number> numbers{
      {Field::uint32, us}, {Field::float64, s}, {Field::uint64, ns}, {Field::float64, ns}, {Field::uint32, ms}};
  cross(PointTimeZero::lidar_clock, numbers, [](const CloudLayout& cloud) {
    expect_read_back(cloud, stated_layout(cloud), false);
    expect_read_back(cloud, inferred_layout(cloud.stamp), true);
  });
}

TEST(PointLayouts, TheWordSaysWhatIsTakenAndHowToSayItOtherwise) {
  WarningLog warnings;
  const Platform platform = platform_of(inferred_layout(std::nullopt));
  PointCloudDecoder decoder("log.bag", platform, warnings);
  std::vector<std::uint8_t> data;
  LidarScan scan;
  decoder.decode(CloudLayout{"time", Field::float32, s}.write(simulated_scans()[0], data), scan);
  EXPECT_THAT(warnings.entries().at("lidar.told_from_content").first_detail,
              AllOf(HasSubstr("/points"),
                    HasSubstr("'time' (float32) as s since the scan's begin; the stamp is the scan's start"),
                    HasSubstr("lidar.fields.time, time_unit, time_zero and stamp in robot.yaml")));
}

std::string layout_error(const CloudLayout& cloud, const LidarMessageLayout& layout, double period_s = 0.1) {
  Platform platform = platform_of(layout);
  platform.suite.lidar.scan_period_s = period_s;
  return message_of<InputError>([&] {
    WarningLog warnings;
    PointCloudDecoder decoder("log.bag", platform, warnings);
    std::vector<std::uint8_t> data;
    LidarScan read;
    decoder.decode(cloud.write(simulated_scans()[0], data), read);
  });
}

TEST(PointLayouts, WhatFitsNoReadingIsOneLine) {
  // Absolute seconds in a float: steps of 128 s.
  const CloudLayout coarse{"time", Field::float32, s, PointTimeZero::epoch};
  EXPECT_THAT(layout_error(coarse, inferred_layout(std::nullopt)),
              AllOf(HasSubstr("log.bag: /points at 1700000000"), HasSubstr("'time' (float32) spans"),
                    HasSubstr("set lidar.fields.time and time_unit, or scan_period_s, in robot.yaml")));
  LidarMessageLayout in_seconds = inferred_layout(std::nullopt);
  in_seconds.time_unit = s;
  EXPECT_THAT(layout_error(coarse, in_seconds), AllOf(HasSubstr("in steps of"), HasSubstr("record it as float64")));
  // Microseconds in 16 bits overflow after 66 ms.
  EXPECT_THAT(layout_error({"t", Field::uint16, us}, inferred_layout(std::nullopt)),
              AllOf(HasSubstr("'t' (uint16) has a limit of 65"), HasSubstr("record it as uint32")));
  // For a wrong unit, the message suggests the right one.
  LidarMessageLayout wrong = stated_layout({"t", Field::uint32, ns});
  wrong.time_zero.reset();
  wrong.time_unit = us;
  EXPECT_THAT(layout_error({"t", Field::uint32, ns}, wrong),
              AllOf(HasSubstr("span 99"), HasSubstr("set lidar.time_unit: ns in robot.yaml")));
  // A usual scan, but another period in the platform file.
  EXPECT_THAT(layout_error({"t", Field::uint32, ns}, stated_layout({"t", Field::uint32, ns}), 100.0),
              AllOf(HasSubstr("expected about the scan's period of 100 s (lidar.scan_period_s)"),
                    HasSubstr("set lidar.scan_period_s, or lidar.time_unit: us, in robot.yaml")));
  // No field has the name of a time.
  EXPECT_THAT(layout_error({"range", Field::uint32, ns}, inferred_layout(std::nullopt)),
              AllOf(HasSubstr("no field has the name of a time; the message has x, y, z, intensity, ring, range"),
                    HasSubstr("set lidar.fields.time")));
}

TEST(PointLayouts, AFieldWithoutTimesIsPassedOverForOneWith) {
  // "t" is the more likely name, but contains a temperature.
  const CloudLayout cloud{"timestamp", Field::float64, s, PointTimeZero::epoch};
  std::vector<std::uint8_t> data;
  ros1::PointCloudMessage message = cloud.write(simulated_scans()[0], data);
  message.fields.push_back({"t", 18, Field::uint16, 1});
  WarningLog warnings;
  const Platform platform = platform_of(inferred_layout(std::nullopt));
  PointCloudDecoder decoder("log.bag", platform, warnings);
  LidarScan read;
  decoder.decode(message, read);
  EXPECT_LT(std::abs(static_cast<double>(read.start - simulated_scans()[0].start)), 300.0);
}

TEST(PointLayouts, WhatIsNoRingsNumberIsARingOfItsOwn) {
  const CloudLayout cloud{"timestamp", Field::float64, s, PointTimeZero::epoch};
  std::vector<std::uint8_t> data;
  ros1::PointCloudMessage message = cloud.write(simulated_scans()[0], data);
  message.fields[4] = {"ring", 16, Field::float32, 1};
  const float rings[] = {0.0F, 7.0F, 65534.0F, -1.0F, 65536.0F, 7e22F, NAN, INFINITY};
  constexpr std::uint16_t expected[] = {0, 7, 65534, 65535, 65535, 65535, 65535, 65535};
  for (std::size_t i = 0; i < simulated_scans()[0].points.size(); ++i) {
    std::memcpy(data.data() + i * CloudLayout::point_step + 16, &rings[i % 8], 4);
  }
  WarningLog warnings;
  const Platform platform = platform_of(inferred_layout(std::nullopt));
  PointCloudDecoder decoder("log.bag", platform, warnings);
  LidarScan read;
  decoder.decode(message, read);
  ASSERT_EQ(read.points.size(), simulated_scans()[0].points.size());
  for (std::size_t i = 0; i < read.points.size(); ++i) EXPECT_EQ(read.points[i].ring, expected[i % 8]) << i;
}

TEST(PointLayouts, APointWithoutATimeIsLeftOut) {
  const LidarScan& scan = simulated_scans()[1];
  for (const bool first_scan : {true, false}) {  // the scan from which times are inferred, and a later one
    for (const double time : {1e300, -1e300, 5e9, static_cast<double>(NAN), 0.0}) {
      const CloudLayout cloud{"timestamp", Field::float64, s, PointTimeZero::epoch};
      std::vector<std::uint8_t> data;
      WarningLog warnings;
      const Platform platform =
          platform_of(first_scan && time == 0.0 ? inferred_layout(std::nullopt) : stated_layout(cloud));
      PointCloudDecoder decoder("log.bag", platform, warnings);
      LidarScan read;
      if (!first_scan) decoder.decode(cloud.write(simulated_scans()[0], data), read);
      const ros1::PointCloudMessage message = cloud.write(scan, data);
      for (const std::size_t i : {std::size_t{7}, std::size_t{100}})
        std::memcpy(data.data() + i * CloudLayout::point_step + 24, &time, 8);
      if (first_scan && (time == 1e300 || time == -1e300 || time == 5e9))
        continue;  // it is not yet known which times are wrong
      decoder.decode(message, read);
      ASSERT_EQ(read.points.size(), scan.points.size() - 2) << time;
      EXPECT_EQ(warnings.count("lidar.untimed_points"), 2) << time;
      EXPECT_EQ(read.points[7].position, scan.points[8].position);
      EXPECT_LT(
          std::abs(static_cast<double>(read.start + read.points[7].offset_ns - scan.start - scan.points[8].offset_ns)),
          300.0);
      // If most points have no time, it is another mistake.
      for (std::size_t i = 0; 2 * i < scan.points.size() + 4; ++i)
        std::memcpy(data.data() + i * CloudLayout::point_step + 24, &time, 8);
      EXPECT_THAT(message_of<InputError>([&] { decoder.decode(message, read); }),
                  AllOf(HasSubstr("log.bag: /points at 1700000000."), HasSubstr("points have no time in 'timestamp'"),
                        HasSubstr("in robot.yaml")))
          << time;
    }
  }
}

TEST(PointLayouts, SparseScansWaitForOneThatTells) {
  const CloudLayout cloud{"time", Field::float32, s, PointTimeZero::stamp, ScanStamp::end};
  LidarScan sparse = simulated_scans()[0];
  const Time third = sparse.start + (sparse.end - sparse.start) / 3;
  // A few points at the scan's begin, within less than a hundredth of the scan in every unit.
  std::erase_if(sparse.points, [&](const LidarPoint& point) { return point.offset_ns > 600'000; });
  ASSERT_LT(sparse.points.size(), 100U);
  WarningLog warnings;
  const Platform platform = platform_of(inferred_layout(std::nullopt));
  PointCloudDecoder decoder("log.bag", platform, warnings);
  std::vector<std::uint8_t> data;
  LidarScan read;
  decoder.decode(cloud.write(sparse, data), read);
  EXPECT_TRUE(read.points.empty());
  EXPECT_EQ(warnings.count("lidar.empty_scan"), 1);
  EXPECT_EQ(warnings.count("lidar.told_from_content"), 0);
  // Again few points, but over a third of a scan: enough for the unit of this scan, not of later scans.
  LidarScan part = simulated_scans()[0];
  std::erase_if(part.points,
                [&](const LidarPoint& point) { return point.ring != 3 || part.start + point.offset_ns > third; });
  ASSERT_LT(part.points.size(), conclusive_points);
  decoder.decode(cloud.write(part, data), read);
  ASSERT_EQ(read.points.size(), part.points.size());
  EXPECT_LT(
      std::abs(static_cast<double>(read.start + read.points[5].offset_ns - part.start - part.points[5].offset_ns)),
      20.0);
  EXPECT_EQ(warnings.count("lidar.told_from_content"), 0);
  decoder.decode(cloud.write(simulated_scans()[1], data), read);
  EXPECT_EQ(read.points.size(), simulated_scans()[1].points.size());
  EXPECT_EQ(warnings.count("lidar.told_from_content"), 1);
}

TEST(PointLayouts, AClockThatJumpsWithinAScanCostsThatScanAlone) {
  const CloudLayout cloud{"timestamp",
                          Field::uint32,
                          us,
                          PointTimeZero::lidar_clock,
                          ScanStamp::start,
                          false,
                          simulated_scans()[0].start - 123'000'000'000};
  WarningLog warnings;
  const Platform platform = platform_of(inferred_layout(ScanStamp::start));
  PointCloudDecoder decoder("log.bag", platform, warnings);
  std::vector<std::uint8_t> data;
  LidarScan read;
  decoder.decode(cloud.write(simulated_scans()[0], data), read);
  EXPECT_GT(read.points.size(), conclusive_points);
  const ros1::PointCloudMessage message = cloud.write(simulated_scans()[1], data);
  std::memset(data.data() + 24, 0, 4);  // an hour counter restarts
  decoder.decode(message, read);
  EXPECT_TRUE(read.points.empty());
  EXPECT_EQ(warnings.count("lidar.clock_jump"), 1);
  decoder.decode(cloud.write(simulated_scans()[2], data), read);
  EXPECT_EQ(read.points.size(), simulated_scans()[2].points.size());
}

}  // namespace
}  // namespace lodestone

#include "frontends/synchronizer/synchronizer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>

namespace lodestone {
namespace {

constexpr Time millisecond = 1'000'000;
constexpr Time origin = 1'700'000'000'000'000'000;

/// Measurements in memory, returned in order of completion.
class ListSource : public MeasurementSource {
 public:
  bool next(Measurement& measurement) override {
    if (position == list.size()) return false;
    measurement = list[position++];
    return true;
  }
  Time begin_time() const override { return origin; }
  Time end_time() const override { return origin; }

  void sort() {
    std::stable_sort(list.begin(), list.end(), [](const Measurement& a, const Measurement& b) {
      return completion_time(a) < completion_time(b);
    });
  }

  std::vector<Measurement> list;
  std::size_t position = 0;
};

/// Scans of 100 ms; IMU samples every 5 ms, with the time in s as angular velocity; fields of two
/// magnetometers every 10 ms.
class SynchronizerTest : public ::testing::Test {
 protected:
  SynchronizerTest() { suite.magnetometers.resize(2); }

  void fill(double seconds) {
    const Time duration = from_seconds(seconds);
    for (Time t = 0; t + 100 * millisecond <= duration; t += 100 * millisecond) {
      LidarScan scan;
      scan.start = origin + t;
      scan.end = scan.start + 99 * millisecond;
      scan.points.resize(10);
      if (!has_scan || has_scan(t)) source.list.push_back(scan);
    }
    for (Time t = -2 * millisecond; t <= duration + 50 * millisecond; t += 5 * millisecond) {
      const ImuSample sample{origin + t, Vector3(to_seconds(t), 0, 0), Vector3(0, 0, 9.8)};
      if (!has_imu || has_imu(t)) source.list.push_back(sample);
    }
    for (Time t = 1 * millisecond; t <= duration + 50 * millisecond; t += 10 * millisecond) {
      for (int k = 0; k < 2; ++k) {
        const MagneticSample sample{origin + t + k * skew, k, Vector3(to_seconds(t), k, 0)};
        if (!has_field || has_field(t, k)) source.list.push_back(sample);
      }
    }
    source.sort();
  }

  std::vector<ScanBundle> bundles(SensorChoice choice = {}) {
    Synchronizer synchronizer(source, suite, warnings, choice);
    std::vector<ScanBundle> result;
    ScanBundle bundle;
    while (synchronizer.next(bundle)) result.push_back(bundle);
    check_contract(result);
    return result;
  }

  /// Properties of every sequence of bundles (core/measurements.h).
  static void check_contract(const std::vector<ScanBundle>& bundles) {
    for (std::size_t k = 0; k < bundles.size(); ++k) {
      const ScanBundle& bundle = bundles[k];
      const Time begin = k == 0 ? bundle.scan.start : bundles[k - 1].scan.end;
      ASSERT_GE(bundle.imu.size(), bundle.scan.end > begin ? 2U : 1U);
      EXPECT_EQ(bundle.imu.front().time, begin);
      EXPECT_EQ(bundle.imu.back().time, bundle.scan.end);
      if (k > 0) {
        EXPECT_EQ(bundle.imu.front().angular_velocity, bundles[k - 1].imu.back().angular_velocity);
      }
      for (std::size_t i = 1; i < bundle.imu.size(); ++i) EXPECT_GT(bundle.imu[i].time, bundle.imu[i - 1].time);
      Time previous = begin;
      for (const MagneticArraySample& sample : bundle.magnetic) {
        EXPECT_GT(sample.time, previous);
        EXPECT_LE(sample.time, bundle.scan.end);
        EXPECT_EQ(sample.field_ut.size(), 2U);
        previous = sample.time;
      }
    }
  }

  ListSource source;
  SensorSuite suite;
  WarningLog warnings;
  Time skew = 0;  ///< of the second magnetometer against the first
  std::function<bool(Time)> has_scan;
  std::function<bool(Time)> has_imu;
  std::function<bool(Time, int)> has_field;
};

TEST_F(SynchronizerTest, DeliversEachWheelSampleOnceBetweenItsScans) {
  fill(1.0);
  const auto without = bundles();
  for (const bool chosen : {false, true}) {
    source.position = 0;
    source.list.clear();
    fill(1.0);
    for (Time t = -50 * millisecond; t <= 1050 * millisecond; t += 20 * millisecond)
      source.list.push_back(WheelSample{origin + t, to_seconds(t)});
    source.sort();
    if (chosen) suite.wheels.emplace();
    const auto result = bundles();
    ASSERT_EQ(result.size(), without.size());
    for (std::size_t k = 0; k < result.size(); ++k) {
      const Time begin = k == 0 ? result[k].scan.start : result[k - 1].scan.end;
      EXPECT_EQ(result[k].wheels.size(), chosen ? 5U : 0U) << k;
      for (const WheelSample& sample : result[k].wheels) {
        EXPECT_GT(sample.time, begin);
        EXPECT_LE(sample.time, result[k].scan.end);
      }
      EXPECT_EQ(result[k].imu.size(), without[k].imu.size());
      EXPECT_EQ(result[k].magnetic.size(), without[k].magnetic.size());
    }
  }
  EXPECT_FALSE(warnings.entries().contains("wheels.late"));
}

TEST_F(SynchronizerTest, InterpolatesTheImuExactlyAtScanEnds) {
  fill(1.0);
  const auto result = bundles();
  ASSERT_EQ(result.size(), 10U);
  for (std::size_t k = 0; k < result.size(); ++k) {
    const double end_s = 0.1 * static_cast<double>(k) + 0.099;
    EXPECT_NEAR(result[k].imu.back().angular_velocity.x(), end_s, 1e-12);
    EXPECT_EQ(result[k].magnetic.size(), 10U);
    EXPECT_EQ(result[k].scan.points.size(), 10U);
    for (const ImuSample& sample : result[k].imu) {
      EXPECT_NEAR(sample.angular_velocity.x(), to_seconds(sample.time - origin), 1e-12);
    }
  }
  EXPECT_NEAR(result[0].imu.front().angular_velocity.x(), 0.0, 1e-12);
  EXPECT_TRUE(warnings.entries().empty());
}

TEST_F(SynchronizerTest, DeskewedScansLastNoTimeAndAreNoOutage) {
  fill(1.0);
  for (Measurement& measurement : source.list) {
    if (auto* scan = std::get_if<LidarScan>(&measurement)) scan->start = scan->end;
  }
  const auto result = bundles();
  EXPECT_TRUE(warnings.entries().empty());
  ASSERT_EQ(result.size(), 10U);
  EXPECT_EQ(result[0].imu.size(), 1U);
  EXPECT_TRUE(result[0].magnetic.empty());
  for (std::size_t k = 1; k < result.size(); ++k) {
    EXPECT_EQ(result[k].scan.points.size(), 10U);
    EXPECT_EQ(result[k].scan.start, result[k].scan.end);
    EXPECT_EQ(result[k].magnetic.size(), 10U);
    EXPECT_NEAR(to_seconds(result[k].imu.back().time - result[k].imu.front().time), 0.1, 1e-12);
  }
}

TEST_F(SynchronizerTest, AnOutageOfDeskewedScansIsFilled) {
  has_scan = [](Time t) { return t < 300 * millisecond || t >= 600 * millisecond; };
  fill(1.0);
  for (Measurement& measurement : source.list) {
    if (auto* scan = std::get_if<LidarScan>(&measurement)) scan->start = scan->end;
  }
  const auto result = bundles();
  ASSERT_EQ(result.size(), 10U) << "a bundle for each period, empty in the outage";
  EXPECT_EQ(warnings.count("lidar.silent"), 3);
  for (std::size_t k = 0; k < result.size(); ++k) {
    EXPECT_EQ(result[k].scan.points.empty(), k >= 3 && k < 6) << k;
    EXPECT_EQ(result[k].scan.end, origin + static_cast<Time>(k) * 100 * millisecond + 99 * millisecond);
  }
}

TEST_F(SynchronizerTest, AnImuSampleExactlyAtTheEndIsNotRepeated) {
  for (Time t = 0; t <= 400 * millisecond; t += 5 * millisecond)
    source.list.push_back(ImuSample{origin + t, Vector3::Zero(), Vector3::Zero()});
  for (int k = 0; k < 3; ++k) {
    LidarScan scan;
    scan.start = origin + k * 100 * millisecond;
    scan.end = scan.start + 100 * millisecond;
    source.list.push_back(scan);
  }
  source.sort();
  const auto result = bundles({.magnetometers = false});
  ASSERT_EQ(result.size(), 3U);
  for (const ScanBundle& bundle : result) EXPECT_EQ(bundle.imu.size(), 21U);
}

TEST_F(SynchronizerTest, GroupsReadingsWithinHalfAPeriodAndLeavesMissingOnesEmpty) {
  skew = 3 * millisecond;
  has_field = [](Time t, int k) {
    return k == 0 || (t != 151 * millisecond && (t < 300 * millisecond || t > 380 * millisecond));
  };
  fill(1.0);
  const auto result = bundles();
  int samples = 0;
  int missing = 0;
  for (const ScanBundle& bundle : result) {
    for (const MagneticArraySample& sample : bundle.magnetic) {
      ++samples;
      ASSERT_TRUE(sample.field_ut[0]);
      if (!sample.field_ut[1]) {
        ++missing;
        EXPECT_EQ((sample.time - origin) % (10 * millisecond), 1 * millisecond);
      } else {
        EXPECT_EQ(sample.field_ut[0]->x(), sample.field_ut[1]->x()) << "readings of different instants in one sample";
        EXPECT_EQ((sample.time - origin) % (10 * millisecond), 2'500'000);
      }
    }
  }
  EXPECT_EQ(samples, 100);
  EXPECT_EQ(missing, 1 + 8);
}

TEST_F(SynchronizerTest, ADeadMagnetometerHoldsNothingUp) {
  has_field = [](Time t, int k) { return k == 0 || t < 500 * millisecond; };
  fill(5.0);
  const auto result = bundles();
  EXPECT_EQ(result.size(), 50U);
  for (std::size_t k = 0; k < result.size(); ++k) EXPECT_EQ(result[k].magnetic.size(), 10U) << k;
}

TEST_F(SynchronizerTest, ASilentLidarGivesEmptyScansAtTheNominalPeriod) {
  has_scan = [](Time t) { return t < 1000 * millisecond || t >= 4000 * millisecond; };
  fill(6.0);
  const auto result = bundles();
  int empty = 0;
  for (std::size_t k = 1; k < result.size(); ++k) {
    const double step_s = to_seconds(result[k].scan.end - result[k - 1].scan.end);
    EXPECT_GT(step_s, 0.049);
    EXPECT_LT(step_s, 0.151);
    EXPECT_GE(result[k].scan.start, result[k - 1].scan.end) << "a scan may not reach back into a bundle before";
    empty += result[k].scan.points.empty() ? 1 : 0;
  }
  EXPECT_NEAR(empty, 30, 1);
  EXPECT_EQ(warnings.count("lidar.silent"), empty);
  EXPECT_EQ(result.size(), 30U + static_cast<std::size_t>(empty));
}

TEST_F(SynchronizerTest, ALidarThatDiesLeavesImuAndFieldToTheEnd) {
  has_scan = [](Time t) { return t < 1000 * millisecond; };
  fill(3.0);
  const auto result = bundles();
  EXPECT_EQ(result.size(), 30U);
  EXPECT_GT(result.back().scan.end, origin + 2900 * millisecond);
  EXPECT_TRUE(result.back().scan.points.empty());
  EXPECT_EQ(result.back().magnetic.size(), 10U);
}

TEST_F(SynchronizerTest, ARunWithoutLidarHasBundlesAtTheNominalPeriod) {
  has_scan = [](Time) { return false; };
  fill(2.0);
  const auto result = bundles({.lidar = false});
  ASSERT_EQ(result.size(), 20U);
  EXPECT_EQ(result[0].scan.start, origin - 2 * millisecond);
  EXPECT_EQ(result[7].scan.end - result[6].scan.end, 100 * millisecond);
  EXPECT_EQ(warnings.count("lidar.silent"), 0);
}

TEST_F(SynchronizerTest, AnImuGapIsBridged) {
  has_imu = [](Time t) { return t < 500 * millisecond || t > 800 * millisecond; };
  fill(2.0);
  const auto result = bundles();
  ASSERT_EQ(result.size(), 20U);
  EXPECT_EQ(warnings.count("imu.held"), 0) << "the samples after a short gap are waited for";
  for (std::size_t i = 0; i < result.size(); ++i) {
    // Samples at 498 and 803 ms: the scans that end at 499, 599, 699, 799 and 899 ms overlap the gap.
    EXPECT_NEAR(result[i].imu_gap_s, i >= 4 && i <= 8 ? 0.305 : 0.005, 1e-9) << i;
  }
}

TEST_F(SynchronizerTest, ALongImuOutageHoldsTheLastSample) {
  has_imu = [](Time t) { return t < 500 * millisecond || t > 3000 * millisecond; };
  fill(5.0);
  const auto result = bundles();
  ASSERT_EQ(result.size(), 50U);
  EXPECT_GT(warnings.count("imu.held"), 10);
  // As long as it is known to be: the sample that ends it is 1 s ahead of the scans that wait for it.
  EXPECT_NEAR(result[3].imu_gap_s, 0.005, 1e-9);
  for (std::size_t i = 5; i < 29; ++i) EXPECT_GE(result[i].imu_gap_s, 0.1 * static_cast<double>(i) - 0.4) << i;
  EXPECT_NEAR(result[29].imu_gap_s, 2.505, 1e-9);
  EXPECT_NEAR(result[31].imu_gap_s, 0.005, 1e-9);
}

TEST_F(SynchronizerTest, ScansWithoutImuAtEitherEndAreDroppedAndCounted) {
  has_imu = [](Time t) { return t > 250 * millisecond && t < 1450 * millisecond; };
  fill(2.0);
  const auto result = bundles();
  ASSERT_FALSE(result.empty());
  EXPECT_EQ(result.front().scan.start, origin + 300 * millisecond);
  EXPECT_EQ(warnings.count("lidar.before_imu"), 3);
  EXPECT_LE(result.back().scan.end, origin + 1550 * millisecond);
  EXPECT_EQ(
      warnings.count("lidar.before_imu") + warnings.count("lidar.after_imu") + static_cast<std::int64_t>(result.size()),
      20);
}

TEST_F(SynchronizerTest, AScanThatComesTooLateIsDroppedAndCounted) {
  fill(1.0);
  LidarScan scan;
  scan.start = origin + 410 * millisecond;
  scan.end = origin + 450 * millisecond;
  source.list.push_back(scan);
  source.list.push_back(ImuSample{origin + 1100 * millisecond, Vector3::Zero(), Vector3::Zero()});
  EXPECT_EQ(bundles().size(), 10U);
  EXPECT_EQ(warnings.count("lidar.late_scan"), 1);
}

TEST_F(SynchronizerTest, EmptyScansAndAnEmptyLogAreNoTrouble) {
  EXPECT_TRUE(bundles().empty());
  EXPECT_TRUE(bundles({.lidar = false}).empty());
  source = {};
  fill(1.0);
  for (Measurement& measurement : source.list) {
    if (auto* each = std::get_if<LidarScan>(&measurement)) each->points.clear();
  }
  EXPECT_EQ(bundles().size(), 10U);
}

/// Records how far the consumer lags behind: the synchronizer stores the measurements in between.
class EndlessSource : public MeasurementSource {
 public:
  bool next(Measurement& measurement) override {
    time_ += millisecond;
    const Time t = time_;
    if (t >= 600'000 * millisecond) return false;
    if (t % (100 * millisecond) == 0) {
      LidarScan scan;
      scan.start = t - 99 * millisecond;
      scan.end = t;
      measurement = scan;
    } else {
      measurement = ImuSample{t, Vector3::Zero(), Vector3::Zero()};
    }
    return true;
  }
  Time begin_time() const override { return 0; }
  Time end_time() const override { return 0; }
  Time time_ = 0;
};

TEST(SynchronizerMemory, HoldsAboutASecondEvenOfALogWithDeadMagnetometers) {
  EndlessSource source;
  SensorSuite suite;
  suite.magnetometers.resize(8);
  WarningLog warnings;
  Synchronizer synchronizer(source, suite, warnings);
  ScanBundle bundle;
  int count = 0;
  while (synchronizer.next(bundle)) {
    ++count;
    EXPECT_LE(source.time_ - bundle.scan.end, 1'500 * millisecond);
  }
  EXPECT_EQ(count, 5999);
}

}  // namespace
}  // namespace lodestone

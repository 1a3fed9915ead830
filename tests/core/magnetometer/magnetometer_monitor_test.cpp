#include "core/magnetometer/magnetometer_monitor.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

namespace lodestone {
namespace {

constexpr int kRate_hz = 200;
constexpr int kPerBundle = 20;

SensorSuite suite_of_three(double noise_ut = 1.0) {
  SensorSuite suite;
  for (const char* name : {"left", "right", "rear"}) suite.magnetometers.push_back({name, {}, noise_ut});
  return suite;
}

/// The field along a drive that begins to move at 2 s, among steel: up to 40 µT/m at 1 m/s.
Vector3 passing_field(double seconds) {
  const double way = std::max(0.0, seconds - 2.0);
  return {20.0 + 15.0 * std::sin(2.0 * way), -5.0 + 10.0 * std::cos(3.0 * way),
          -40.0 + 12.0 * std::sin(2.5 * way + 1.0)};
}

/// The readings that the monitor keeps of `seconds`, by magnetometer and sample. `spoil` changes a healthy reading of a
/// magnetometer at a time; empty: the reading is missing.
struct Filtered {
  std::vector<std::vector<bool>> left;  // of the readings that were given
  std::vector<std::vector<double>> time;
  WarningLog warnings;

  int out(int magnetometer, double from_s, double to_s) const {
    int count = 0;
    const auto j = static_cast<std::size_t>(magnetometer);
    for (std::size_t i = 0; i < left[j].size(); ++i) count += !left[j][i] && time[j][i] >= from_s && time[j][i] < to_s;
    return count;
  }
};

Filtered filter(double seconds, const std::function<std::optional<Vector3>(int, double, const Vector3&)>& spoil,
                double quantum_ut = 0.0, double noise_ut = 1.0) {
  Filtered result;
  result.left.resize(3);
  result.time.resize(3);
  MagnetometerMonitor monitor(suite_of_three(), &result.warnings);
  std::mt19937_64 generator(5);
  std::normal_distribution<double> normal(0.0, noise_ut);
  std::vector<MagneticArraySample> samples;
  for (int i = 0; i < seconds * kRate_hz; ++i) {
    const double s = static_cast<double>(i) / kRate_hz;
    MagneticArraySample sample{from_seconds(s), std::vector<std::optional<Vector3>>(3)};
    for (int j = 0; j < 3; ++j) {
      Vector3 reading = passing_field(s) + Vector3(normal(generator), normal(generator), normal(generator));
      if (quantum_ut > 0.0) reading = (reading / quantum_ut).array().round() * quantum_ut;
      sample.field_ut[static_cast<std::size_t>(j)] = spoil(j, s, reading);
    }
    samples.push_back(sample);
    if (static_cast<int>(samples.size()) < kPerBundle) continue;
    const auto filtered = monitor.without_unhealthy(samples, samples.back().time);
    for (std::size_t k = 0; k < samples.size(); ++k) {
      for (std::size_t j = 0; j < 3; ++j) {
        if (!samples[k].field_ut[j]) continue;
        const auto& after = filtered ? (*filtered)[k].field_ut[j] : samples[k].field_ut[j];
        EXPECT_TRUE(!after || *after == *samples[k].field_ut[j]);
        result.left[j].push_back(after.has_value());
        result.time[j].push_back(to_seconds(samples[k].time));
      }
    }
    samples.clear();
  }
  return result;
}

std::optional<Vector3> healthy(int, double, const Vector3& reading) {
  return reading;
}

TEST(MagnetometerMonitor, LeavesHealthyReadingsAlone) {
  EXPECT_TRUE(filter(20.0, healthy).warnings.entries().empty());
  // Sensors with coarse digits, better than their data sheet, and worse.
  for (const double noise_ut : {0.2, 3.0}) {
    const Filtered coarse = filter(20.0, healthy, 0.15, noise_ut);
    for (int j = 0; j < 3; ++j) EXPECT_EQ(coarse.out(j, 0.0, 20.0), 0) << noise_ut;
  }
}

TEST(MagnetometerMonitor, AStuckMagnetometerIsLeftOutWithinATenthOfASecondAndComesBackAtOnce) {
  std::optional<Vector3> held;
  const Filtered found = filter(10.0, [&](int j, double s, const Vector3& reading) -> std::optional<Vector3> {
    if (j != 1 || s < 4.0 || s >= 7.0) return reading;
    if (!held) held = reading;
    return *held;
  });
  EXPECT_EQ(found.out(1, 4.1225, 7.0), 575);  // all of them
  EXPECT_EQ(found.out(1, 0.0, 4.09) + found.out(1, 7.0, 10.0), 0);
  EXPECT_EQ(found.out(0, 0.0, 10.0) + found.out(2, 0.0, 10.0), 0);
  ASSERT_EQ(found.warnings.entries().size(), 1U);
  EXPECT_EQ(found.warnings.count("magnetometer.stuck.right"), found.out(1, 0.0, 10.0));
}

TEST(MagnetometerMonitor, AllStuckAtOnceAreLeftOutToo) {
  const Filtered found = filter(6.0, [](int, double s, const Vector3& reading) -> std::optional<Vector3> {
    return s < 4.0 ? reading : Vector3(1.0, 2.0, 3.0);
  });
  for (int j = 0; j < 3; ++j) EXPECT_EQ(found.out(j, 4.1525, 6.0), 369);  // all of them
}

TEST(MagnetometerMonitor, ReadingsAtASensorsLimitAreLeftOutOnceTheLimitIsSeen) {
  constexpr double kLimit_ut = 30.0;
  int clipped = 0;
  const Filtered found = filter(20.0, [&](int j, double s, const Vector3& reading) -> std::optional<Vector3> {
    if (j != 0) return reading;
    const Vector3 result = reading.cwiseMax(-kLimit_ut).cwiseMin(kLimit_ut);
    clipped += s >= 5.0 && result != reading;
    return result;
  });
  // And a few that noise left below the limit by less than a fiftieth of the noise.
  EXPECT_GE(found.out(0, 5.0, 20.0), clipped);
  EXPECT_LE(found.out(0, 5.0, 20.0), clipped + 10);
  EXPECT_GT(clipped, 500);
  EXPECT_EQ(found.out(1, 0.0, 20.0) + found.out(2, 0.0, 20.0), 0);
  EXPECT_GT(found.warnings.count("magnetometer.limit.left"), 0);
}

TEST(MagnetometerMonitor, ALimitThatOneSensorShowedIsAnothersAfterThreeReadings) {
  // The second sensor clips a second after the first has shown its limit: three readings suffice.
  constexpr double kLimit_ut = 30.0;
  int clipped = 0;
  const Filtered found = filter(8.0, [&](int j, double s, const Vector3& reading) -> std::optional<Vector3> {
    if (j == 2 || (j == 1 && s < 4.0)) return reading;
    const Vector3 result = reading.cwiseMax(-kLimit_ut).cwiseMin(kLimit_ut);
    if (j == 1) clipped += result != reading;
    return result;
  });
  EXPECT_GT(clipped, 100);
  EXPECT_GE(found.out(1, 4.0, 8.0), clipped - 2);
  EXPECT_EQ(found.out(1, 0.0, 4.0) + found.out(2, 0.0, 8.0), 0);
}

TEST(MagnetometerMonitor, SpikesAreLeftOutAndTheirNeighboursStay) {
  int spikes = 0;
  const Filtered found = filter(20.0, [&](int j, double s, const Vector3& reading) -> std::optional<Vector3> {
    if (j != 2 || std::lround(s * kRate_hz) % 47 != 11) return reading;
    ++spikes;
    return reading + Vector3(0.0, 30.0, -20.0);
  });
  EXPECT_EQ(found.out(2, 0.0, 20.0), spikes);
  EXPECT_EQ(found.warnings.count("magnetometer.spike.rear"), spikes);
  EXPECT_EQ(found.out(0, 0.0, 20.0) + found.out(1, 0.0, 20.0), 0);
}

TEST(MagnetometerMonitor, TellsOfAMagnetometerThatFellSilent) {
  const Filtered found = filter(10.0, [](int j, double s, const Vector3& reading) -> std::optional<Vector3> {
    if (j == 0 && s >= 5.0) return std::nullopt;
    return reading;
  });
  ASSERT_EQ(found.warnings.entries().size(), 1U);
  EXPECT_NEAR(static_cast<double>(found.warnings.count("magnetometer.silent.left")), 40.0, 2.0);
  EXPECT_NE(found.warnings.entries().begin()->second.first_detail.find("4.995 s"), std::string::npos);
}

}  // namespace
}  // namespace lodestone

#include "tools/check/field_exchange.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

namespace lodestone {
namespace {

constexpr std::size_t mounts = 6;

/// The field at mount k along a drive, µT: mounts are 0.2 m apart, the field of steel has waves of 2 m.
Vector3 field_at(std::size_t mount, double way_m) {
  const double place = 3.0 * (way_m + 0.2 * static_cast<double>(mount));
  return {20.0 + 6.0 * std::sin(place), 5.0 * std::cos(1.3 * place), -40.0 + 7.0 * std::sin(0.8 * place + 0.5)};
}

/// Magnetometer j has the readings of mount `read[j]`, with its own offset.
std::vector<FieldSeries> make_array(const std::vector<std::size_t>& read, double offset_ut, std::mt19937& random) {
  std::normal_distribution<double> noise(0.0, 0.3);
  std::normal_distribution<double> offset(0.0, offset_ut);
  std::vector<FieldSeries> all(mounts);
  for (std::size_t j = 0; j < mounts; ++j) {
    const Vector3 iron(offset(random), offset(random), offset(random));
    for (int i = 0; i < 300; ++i) {
      const double way_m = 0.02 * i;
      if (i % 50 == static_cast<int>(j)) continue;  // lost messages: the magnetometers have different stamps
      all[j].times.push_back(from_seconds(0.02 * i));
      all[j].expected_ut.push_back(field_at(j, way_m));
      all[j].measured_ut.push_back(field_at(read[j], way_m) + iron +
                                   Vector3(noise(random), noise(random), noise(random)));
      all[j].variance_ut2.push_back(0.04);
      all[j].noise_ut2.push_back(0.09);
    }
  }
  return all;
}

TEST(FieldExchange, FindsEveryPermutation) {
  std::mt19937 random(3);
  std::vector<std::size_t> read(mounts);
  std::iota(read.begin(), read.end(), std::size_t{0});
  for (int run = 0; run < 40; ++run) {
    EXPECT_EQ(match_mounts(make_array(read, 0.0, random)), read);
    std::shuffle(read.begin(), read.end(), random);
  }
}

TEST(FieldExchange, BlamesNoHardIronOnTheWiring) {
  std::mt19937 random(5);
  std::vector<std::size_t> own(mounts);
  std::iota(own.begin(), own.end(), std::size_t{0});
  for (const double offset_ut : {1.0, 3.0, 10.0}) {
    for (int run = 0; run < 40; ++run) EXPECT_EQ(match_mounts(make_array(own, offset_ut, random)), own);
  }
}

/// Two channels with the readings of one magnetometer: the second is wrong, but no channel has the missing readings.
TEST(FieldExchange, NeedsAWholeRing) {
  std::mt19937 random(7);
  EXPECT_EQ(match_mounts(make_array({0, 0, 2, 3, 4, 5}, 0.0, random)), (std::vector<std::size_t>{0, 1, 2, 3, 4, 5}));
  std::vector<FieldSeries> silent = make_array({1, 0, 2, 3, 4, 5}, 0.0, random);
  silent[0] = FieldSeries{};
  EXPECT_EQ(match_mounts(silent), (std::vector<std::size_t>{0, 1, 2, 3, 4, 5}));
}

}  // namespace
}  // namespace lodestone

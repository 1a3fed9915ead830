#include "estimators/baselines/continuous_time/localizability_sampling.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <random>

namespace lodestone {
namespace {

ObservedDirections observed_by(const Vector3& normal, const Vector3& lever) {
  return {normal.normalized(), lever.cross(normal).normalized()};
}

/// Points of a corridor along x: walls and floor, and a few on the end.
class LocalizabilitySamplingTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::mt19937_64 generator(9);
    std::uniform_real_distribution<double> along(-8.0, 8.0);
    std::normal_distribution<double> wobble(0.0, 0.02);
    for (int i = 0; i < 1000; ++i) {
      const double x = along(generator);
      const double tilt = wobble(generator);
      const bool end = i % 200 == 0;
      const bool wall = i % 2 == 1;
      if (end) ends_.push_back(points_.size());
      points_.push_back(end    ? observed_by({1.0, tilt, 0.0}, {8.0, 0.5 * tilt, 0.3})
                        : wall ? observed_by({tilt, 1.0, 0.0}, {x, 1.5, 0.4})
                               : observed_by({tilt, 0.0, 1.0}, {x, tilt, -0.5}));
    }
  }

  double sum_along(const Vector3& axis, const std::vector<std::size_t>& kept) const {
    return std::accumulate(kept.begin(), kept.end(), 0.0,
                           [&](double sum, std::size_t i) { return sum + std::abs(axis.dot(points_[i].translation)); });
  }

  std::vector<ObservedDirections> points_;
  std::vector<std::size_t> ends_;
};

TEST_F(LocalizabilitySamplingTest, KeepsEveryPointOfAWeakDirectionAndFewOfTheOthers) {
  const std::vector<std::size_t> kept = LocalizabilitySampling(50.0, 1).sample(points_);
  for (const std::size_t end : ends_) EXPECT_TRUE(std::binary_search(kept.begin(), kept.end(), end)) << end;
  EXPECT_LT(kept.size(), points_.size() / 2);
  EXPECT_GE(sum_along(Vector3::UnitY(), kept), 50.0);
  EXPECT_GE(sum_along(Vector3::UnitZ(), kept), 50.0);
  EXPECT_TRUE(std::is_sorted(kept.begin(), kept.end()));
}

TEST_F(LocalizabilitySamplingTest, KeepsAllPointsThatContributeIfTheyAreTooFew) {
  points_.push_back({});  // without a plane
  const std::vector<std::size_t> kept = LocalizabilitySampling(1e6, 1).sample(points_);
  EXPECT_EQ(kept.size(), points_.size() - 1);
  EXPECT_EQ(kept.back(), points_.size() - 2);
}

TEST_F(LocalizabilitySamplingTest, CountsThePointsOfTheWindowsBefore) {
  LocalizabilitySampling one(100.0, 1);
  LocalizabilitySampling five(100.0, 5);
  const std::size_t first = one.sample(points_).size();
  ASSERT_EQ(five.sample(points_).size(), first);
  EXPECT_EQ(one.sample(points_).size(), first);
  EXPECT_LT(five.sample(points_).size(), first / 2);
  for (int i = 0; i < 5; ++i) five.sample({});
  EXPECT_EQ(five.sample(points_).size(), first) << "windows before the last four are forgotten";
}

TEST_F(LocalizabilitySamplingTest, DoesNotDependOnTheAxesOfTheMap) {
  const std::vector<std::size_t> kept = LocalizabilitySampling(50.0, 1).sample(points_);
  const Quaternion turn = so3::exp({0.3, -0.8, 1.1});
  for (ObservedDirections& point : points_) {
    point.translation = turn * point.translation;
    point.rotation = turn * point.rotation;
  }
  const std::vector<std::size_t> turned = LocalizabilitySampling(50.0, 1).sample(points_);
  std::vector<std::size_t> both;
  std::set_intersection(kept.begin(), kept.end(), turned.begin(), turned.end(), std::back_inserter(both));
  EXPECT_GT(both.size(), kept.size() * 98 / 100);  // rounding orders equal contributions
}

}  // namespace
}  // namespace lodestone

#include "estimators/initialization/place_search.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "core/lidar/plane_map.h"

namespace lodestone {
namespace {

/// A hall of 12 × 9 m: a floor with posts of random heights, on 60 by 48 cells.
SiteLevel random_level(std::uint64_t seed) {
  std::mt19937_64 generator(seed);
  SiteLevel level;
  level.origin_m = Eigen::Vector2d(-3.0, 2.0);
  level.columns = 48 + 2 * PlaceSearch::margin_cells;
  level.rows = 36 + 2 * PlaceSearch::margin_cells;
  const std::size_t count = static_cast<std::size_t>(level.columns) * static_cast<std::size_t>(level.rows);
  level.floor_m.assign(count, 0.0F);
  level.cells.assign(count, 0);
  for (int row = 0; row < 36; ++row) {
    for (int column = 0; column < 48; ++column) {
      std::uint32_t& cell =
          level.cells[level.index(column + PlaceSearch::margin_cells, row + PlaceSearch::margin_cells)];
      cell = SiteLevel::standable;
      if (generator() % 9 == 0) cell |= SiteLevel::band_mask(0.2, 0.2 + 0.3 * static_cast<double>(generator() % 9));
    }
  }
  return level;
}

/// A scan taken on the level, with a fifth of random points.
std::vector<SearchPoint> scan_of(const SiteLevel& level, std::uint64_t seed, int count) {
  std::mt19937_64 generator(seed);
  const Eigen::Vector2d robot = level.center(PlaceSearch::margin_cells + 20, PlaceSearch::margin_cells + 15);
  const Eigen::Rotation2Dd turn(-0.5 * std::numbers::pi);  // to the robot's axes, whose forward axis is y
  std::uniform_real_distribution<float> anywhere(-5.0F, 5.0F);
  std::vector<SearchPoint> points;
  while (static_cast<int>(points.size()) < count) {
    const int column = static_cast<int>(generator() % static_cast<std::uint64_t>(level.columns));
    const int row = static_cast<int>(generator() % static_cast<std::uint64_t>(level.rows));
    const std::uint32_t bands = level.cells[level.index(column, row)] & ~SiteLevel::standable;
    if (bands == 0) continue;
    SearchPoint point{(turn * (level.center(column, row) - robot)).cast<float>(), bands};
    if (points.size() % 5 == 0) point.offset_m = {anywhere(generator), anywhere(generator)};
    points.push_back(point);
  }
  return points;
}

TEST(PlaceSearch, ABlocksBoundIsAboveTheScoreOfEveryPlaceInIt) {
  const SiteLevel level = random_level(3);
  const PlaceSearch search({level}, {});
  const std::vector<SearchPoint> points = scan_of(level, 4, 60);
  std::mt19937_64 generator(5);
  int tight = 0;
  for (int trial = 0; trial < 120; ++trial) {
    const int k = 1 + trial % PlaceSearch::depth;
    const int size = 1 << k;
    const int column = static_cast<int>(generator() % static_cast<std::uint64_t>(level.columns / size)) * size;
    const int row = static_cast<int>(generator() % static_cast<std::uint64_t>(level.rows / size)) * size;
    const double yaw = 2.0 * std::numbers::pi * static_cast<double>(trial) / 120.0;
    const double bound = search.bound(points, 0, k, column, row, yaw);
    double best = -1e9;
    for (int y = row; y < row + size; ++y) {
      for (int x = column; x < column + size; ++x) best = std::max(best, search.bound(points, 0, 0, x, y, yaw));
    }
    EXPECT_GE(bound, best) << "k " << k << " at " << column << " " << row;
    if (k == 1 && bound < best + 0.35 * points.size()) ++tight;
  }
  EXPECT_GT(tight, 0) << "a bound that is always far above the scores prunes nothing";
}

TEST(PlaceSearch, FindsTheBestPlaceOfTheWholeGrid) {
  const SiteLevel level = random_level(7);
  const PlaceSearch search({level}, {}, 24);
  const std::vector<SearchPoint> points = scan_of(level, 8, 50);
  std::vector<Place> all;
  for (int heading = 0; heading < 24; ++heading) {
    for (int row = 0; row < level.rows; ++row) {
      for (int column = 0; column < level.columns; ++column) {
        if ((level.cells[level.index(column, row)] & SiteLevel::standable) == 0) continue;
        all.push_back({0, level.center(column, row), 2.0 * std::numbers::pi * heading / 24.0, 0.0});
      }
    }
  }
  search.score(points, all);
  double best = -1e9;
  for (const Place& place : all) best = std::max(best, place.score);
  ASSERT_GT(best, 0.0);
  const PlaceSearchResult result = search.best(points);
  ASSERT_FALSE(result.places.empty());
  EXPECT_TRUE(result.complete);
  EXPECT_EQ(result.places.front().score, best);
  EXPECT_LT(
      (result.places.front().position_m - level.center(PlaceSearch::margin_cells + 20, PlaceSearch::margin_cells + 15))
          .norm(),
      0.3);
  // All places that fit as well as the worst result are in the result, except for neighbours of better ones.
  for (const Place& place : all) {
    if (place.score <= result.places.back().score) continue;
    const bool near = std::any_of(result.places.begin(), result.places.end(), [&](const Place& other) {
      return other.score >= place.score && (other.position_m - place.position_m).norm() < 0.5;
    });
    EXPECT_TRUE(near) << place.position_m.transpose() << " " << place.score;
  }
}

TEST(PlaceSearch, GivesTheSamePlacesOnOneAndTwoThreads) {
  const PlaceSearch search({random_level(9), random_level(10)}, {});
  const std::vector<SearchPoint> points = scan_of(random_level(10), 11, 80);
  std::vector<PlaceSearchResult> results;
  for (const std::size_t threads : {1U, 2U}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    results.push_back(search.best(points));
  }
  ASSERT_EQ(results[0].places.size(), results[1].places.size());
  for (std::size_t i = 0; i < results[0].places.size(); ++i) {
    EXPECT_EQ(results[0].places[i].level, results[1].places[i].level);
    EXPECT_EQ(results[0].places[i].position_m, results[1].places[i].position_m);
    EXPECT_EQ(results[0].places[i].yaw, results[1].places[i].yaw);
  }
}

TEST(PlaceSearch, SaysWhenItEndedEarly) {
  PlaceSearchOptions options;
  options.max_nodes = 1000;
  const PlaceSearch search({random_level(3)}, options);
  EXPECT_FALSE(search.best(scan_of(random_level(3), 4, 60)).complete);
}

/// Points of a level surface every 5 cm, with survey noise.
void add_floor(std::vector<Eigen::Vector3f>& points, float x0, float x1, float y0, float y1, float z,
               float slope = 0.0F) {
  std::mt19937_64 generator(points.size());
  std::normal_distribution<float> noise(0.0F, 0.005F);
  for (float x = x0; x < x1; x += 0.05F) {
    for (float y = y0; y < y1; y += 0.05F) points.emplace_back(x, y, z + slope * (x - x0) + noise(generator));
  }
}

TEST(SiteLevels, AreTheStoreysARobotCanRollOnto) {
  std::vector<Eigen::Vector3f> points;
  add_floor(points, 0.0F, 12.0F, 0.0F, 8.0F, 0.0F);
  add_floor(points, 0.0F, 12.0F, 0.0F, 8.0F, 3.1F);
  add_floor(points, 4.0F, 5.0F, 4.0F, 5.0F, 0.75F);  // a table is no storey
  const std::vector<SiteLevel> levels = find_levels(PlaneMap(points, {}), PlaceSearch::margin_cells);
  ASSERT_EQ(levels.size(), 2U);
  for (const SiteLevel& level : levels) {
    const std::size_t cell = level.index(level.column_of(4.5), level.row_of(4.5));
    const float floor = level.floor_m[cell];
    EXPECT_TRUE(std::abs(floor) < 0.02F || std::abs(floor - 3.1F) < 0.02F) << floor;
    EXPECT_NE(level.cells[cell] & SiteLevel::standable, 0U);
    if (std::abs(floor) < 0.02F) {
      EXPECT_NE(level.cells[cell] & SiteLevel::band_mask(0.7, 0.8), 0U);  // the table
      EXPECT_NE(level.cells[cell] & SiteLevel::band_mask(3.0, 3.2), 0U);  // the ceiling
      EXPECT_EQ(level.cells[cell] & SiteLevel::band_mask(1.6, 2.5), 0U);
    }
  }
}

TEST(SiteLevels, FollowARamp) {
  std::vector<Eigen::Vector3f> points;
  add_floor(points, 0.0F, 20.0F, 0.0F, 4.0F, 0.0F, 0.1F);
  const std::vector<SiteLevel> levels = find_levels(PlaneMap(points, {}), PlaceSearch::margin_cells);
  ASSERT_EQ(levels.size(), 1U);
  const SiteLevel& level = levels.front();
  for (const double x : {2.0, 10.0, 18.0}) {
    EXPECT_NEAR(static_cast<double>(level.floor_m[level.index(level.column_of(x), level.row_of(2.0))]), 0.1 * x, 0.03);
  }
}

TEST(SiteLevels, AreNoneWithoutALevelSurface) {
  std::vector<Eigen::Vector3f> wall;
  for (float y = 0.0F; y < 10.0F; y += 0.05F) {
    for (float z = 0.0F; z < 3.0F; z += 0.05F) wall.emplace_back(1.0F, y, z);
  }
  EXPECT_TRUE(find_levels(PlaneMap(wall, {}), PlaceSearch::margin_cells).empty());
}

}  // namespace
}  // namespace lodestone

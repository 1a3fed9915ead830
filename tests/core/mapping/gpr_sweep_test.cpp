#include "core/mapping/gpr_sweep.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <random>

#include "core/mapping/sliding_gpr.h"

namespace lodestone {
namespace {

/// A winding lane of some hundred cells.
std::vector<FieldCell> lane() {
  std::mt19937_64 generator(3);
  std::normal_distribution<double> noise(0.0, 0.1);
  std::vector<FieldCell> cells;
  for (int i = 0; i < 700; ++i) {
    const double along = 0.02 * i;
    FieldCell cell;
    cell.position = {2.0 + std::sin(along) + noise(generator), along + noise(generator), 0.1};
    cell.field_ut = {std::sin(2.0 * cell.position.x()), std::cos(cell.position.y()), noise(generator)};
    cell.variance_ut2 = 0.01;
    cell.count = 1;
    cells.push_back(cell);
  }
  return cells;
}

SlidingGpr regression() {
  KernelParameters kernel;
  kernel.signal_sigma = 1.0;
  kernel.mean_sigma = 1.0;
  SlidingGprOptions options;
  options.window_points = 60;
  return SlidingGpr(lane(), {kernel, kernel, kernel}, options);
}

/// Supported points of a grid, row by row from below, in two layers.
std::vector<Vector3> grid_points(const SlidingGpr& gpr) {
  std::vector<Vector3> points;
  for (double y = -1.0; y < 16.0; y += 0.1) {
    for (const double z : {0.1, 0.3}) {
      for (double x = 0.0; x < 5.0; x += 0.1) {
        if (gpr.supports({x, y, z})) points.emplace_back(x, y, z);
      }
    }
  }
  return points;
}

bool same_prediction(const FieldPrediction& a, const FieldPrediction& b) {
  return std::memcmp(a.field_ut.data(), b.field_ut.data(), 24) == 0 &&
         std::memcmp(a.sigma_ut.data(), b.sigma_ut.data(), 24) == 0;
}

TEST(GprSweep, RowByRowGivesTheBitsOfAllAtOnceInLittleMemory) {
  const SlidingGpr gpr = regression();
  const std::vector<Vector3> points = grid_points(gpr);
  ASSERT_GT(points.size(), 3000U);
  const std::vector<FieldPrediction> all = gpr.predict(points);
  for (const int every : {1, 7}) {
    std::vector<FieldPrediction> found(points.size());
    std::size_t emitted = 0;
    std::size_t most = 0;
    GprSweep sweep(gpr, [&](std::int64_t tag, const FieldPrediction& prediction) {
      found[static_cast<std::size_t>(tag)] = prediction;
      ++emitted;
    });
    int rows = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const bool row_begins = i > 0 && points[i].y() > points[i - 1].y();
      if (row_begins && ++rows % every == 0) sweep.complete_below(points[i].y());
      sweep.add(points[i], static_cast<std::int64_t>(i));
      most = std::max(most, sweep.waiting());
    }
    sweep.finish();
    EXPECT_EQ(emitted, points.size());
    EXPECT_LT(most, points.size() / 4);
    for (std::size_t i = 0; i < points.size(); ++i) ASSERT_TRUE(same_prediction(found[i], all[i])) << every << " " << i;
  }
}

TEST(GprSweep, TheSameOnOneThread) {
  const SlidingGpr gpr = regression();
  const std::vector<Vector3> points = grid_points(gpr);
  const std::vector<FieldPrediction> many = gpr.predict(points);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const std::vector<FieldPrediction> alone = gpr.predict(points);
  for (std::size_t i = 0; i < points.size(); ++i) ASSERT_TRUE(same_prediction(many[i], alone[i])) << i;
}

}  // namespace
}  // namespace lodestone

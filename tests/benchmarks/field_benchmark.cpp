#include <benchmark/benchmark.h>

#include <cmath>
#include <memory>
#include <random>

#include "core/magnetometer/localization.h"
#include "core/magnetometer/magnetic_map.h"
#include "core/magnetometer/sparse_field_nodes.h"
#include "core/mapping/sliding_gpr.h"

namespace lodestone {
namespace {

/// A site of 90 by 80 m with a node every 10 cm: the map is larger than the processor's caches.
const MagneticMap& site() {
  static const MagneticMap map = [] {
    FieldGrid grid{0.1, {0.0, 0.0}, 901, 801, {0.12}};
    std::vector<Eigen::Vector4f> nodes;
    for (int row = 0; row < grid.rows; ++row) {
      for (int column = 0; column < grid.columns; ++column) {
        const float x = 0.1F * static_cast<float>(column);
        const float y = 0.1F * static_cast<float>(row);
        nodes.emplace_back(18 + 5 * std::sin(2 * x), -3 + 4 * std::cos(3 * y + x), -42 + 6 * std::sin(x - 2 * y), 0.2F);
      }
    }
    return MagneticMap(grid, nodes, 1.0);
  }();
  return map;
}

/// The same map, of which a drive's tiles are loaded on demand.
const MagneticMap& site_in_tiles() {
  static const MagneticMap map = [] {
    const auto nodes = std::make_shared<SparseFieldNodes>();
    const FieldGrid& grid = site().grid();
    for (int row = 0; row < grid.rows; ++row) {
      for (int column = 0; column < grid.columns; ++column) nodes->set(0, row, column, site().node(0, row, column));
    }
    return MagneticMap(grid, nodes, 1.0, 0);
  }();
  return map;
}

/// Positions along a drive, 5 mm apart as at 200 Hz and 1 m/s (`random` false), or random ones.
std::vector<Vector3> positions(bool random) {
  std::vector<Vector3> result;
  std::mt19937_64 generator(1);
  for (int i = 0; i < 16384; ++i) {
    const auto uniform = [&] { return static_cast<double>(generator() >> 11) * 0x1.0p-53; };
    if (random) {
      result.push_back({90.0 * uniform(), 80.0 * uniform(), 0.1});
    } else {
      result.push_back({5.0 + 0.005 * i, 40.0 + 2.0 * std::sin(0.001 * i), 0.1});
    }
  }
  return result;
}

void map_query(benchmark::State& state, FieldInterpolation interpolation, bool random, bool tiles = false) {
  const MagneticMap& map = tiles ? site_in_tiles() : site();
  const std::vector<Vector3> points = positions(random);
  std::size_t i = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(map.query(points[i], interpolation));
    i = (i + 1) & 16383;
  }
}
BENCHMARK_CAPTURE(map_query, bilinear_along_a_drive, FieldInterpolation::bilinear, false);
BENCHMARK_CAPTURE(map_query, bicubic_along_a_drive, FieldInterpolation::bicubic, false);
BENCHMARK_CAPTURE(map_query, bilinear_along_a_drive_in_tiles, FieldInterpolation::bilinear, false, true);
BENCHMARK_CAPTURE(map_query, bicubic_along_a_drive_in_tiles, FieldInterpolation::bicubic, false, true);
BENCHMARK_CAPTURE(map_query, bilinear_anywhere, FieldInterpolation::bilinear, true);
BENCHMARK_CAPTURE(map_query, bicubic_anywhere, FieldInterpolation::bicubic, true);

/// Gauss-Newton localization with one sample of eight magnetometers, from an initial error of 5 cm and 1°.
void magnetic_localization(benchmark::State& state) {
  const MagneticMap& map = site();
  SensorSuite suite;
  MagneticArraySample sample;
  const Pose truth{so3::exp(Vector3(0, 0, 0.3)), Vector3(40.0, 30.0, 0.2)};
  for (int j = 0; j < 8; ++j) {
    suite.magnetometers.push_back(
        {"", {Quaternion::Identity(), Vector3(j < 4 ? 0.3 : -0.3, 0.25 - 0.17 * (j % 4), -0.08)}, 1.0});
    const auto field = map.query(truth * suite.magnetometers.back().T_imu_mag.position, FieldInterpolation::bicubic);
    sample.field_ut.emplace_back(truth.rotation.conjugate() * field->field_ut);
  }
  Vector6 off;
  off << 0.0, 0.0, 0.017, 0.03, -0.04, 0.0;
  const Pose predicted = truth.boxplus(off);
  Vector6 sigma;
  sigma << 0.02, 0.02, 0.02, 0.05, 0.05, 0.05;
  const Matrix6 prior = sigma.cwiseAbs2().asDiagonal();
  for (auto _ : state) benchmark::DoNotOptimize(localize(predicted, prior, sample, suite, map, {}));
}
BENCHMARK(magnetic_localization);

/// 25 nodes by s-GPR: a few windows of 350 training cells each, three components.
void sliding_gpr_window(benchmark::State& state) {
  std::vector<FieldCell> cells;
  for (int row = 0; row < 19; ++row) {
    for (int column = 0; column < 19; ++column) {
      const Vector3 p(0.1 * column, 0.1 * row, 0.1);
      cells.push_back({p, {5 * std::sin(2 * p.x()), 4 * std::cos(3 * p.y()), 6 * std::sin(p.x() - p.y())}, 0.05, 20});
    }
  }
  const KernelParameters kernel{0.0, 20.0, 5.0, 0.4, 0.1};
  const SlidingGpr regression(cells, {kernel, kernel, kernel}, SlidingGprOptions{});
  std::vector<Vector3> nodes;
  for (int row = 0; row < 5; ++row) {
    for (int column = 0; column < 5; ++column) nodes.push_back({0.75 + 0.08 * column, 0.75 + 0.08 * row, 0.1});
  }
  for (auto _ : state) benchmark::DoNotOptimize(regression.predict(nodes));
}
BENCHMARK(sliding_gpr_window)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace lodestone

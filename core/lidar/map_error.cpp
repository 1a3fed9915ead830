#include "core/lidar/map_error.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <map>

namespace lodestone {

namespace {

constexpr std::size_t kFewestCubes = 4;

/// A cube whose mean offset has a smaller sigma counts fully in the estimate of the variance.
constexpr double kWellKnown_m = 0.005;

/// Sums the cubes of each cell. Centers are weighted by the trace of the gain.
std::vector<PlaceOffset> joined_in_cells(const std::vector<PlaceOffset>& cubes) {
  std::map<MapErrorCube, PlaceOffset> cells;
  std::map<MapErrorCube, double> weights;
  for (const PlaceOffset& cube : cubes) {
    const MapErrorCube key = cell_of(cube.key);
    PlaceOffset& cell = cells[key];
    cell.key = key;
    const double weight = cube.gain.trace();
    cell.center += weight * cube.center;
    weights[key] += weight;
    cell.offset_m += cube.offset_m;
    cell.gain += cube.gain;
    cell.coupling += cube.coupling;
    cell.by_pose += cube.by_pose;
  }
  std::vector<PlaceOffset> result;
  for (auto& [key, cell] : cells) {
    cell.center /= weights.at(key);
    result.push_back(cell);
  }
  return result;
}

}  // namespace

double map_error_correlation(double squared_distance_m2, int part) {
  const double length_m = map_error_length_m(part);
  const double exponent = 0.5 * squared_distance_m2 / (length_m * length_m);
  return exponent > 12.0 ? 0.0 : std::exp(-exponent);
}

MapError analyse_map_error(std::span<const Correspondence> correspondences, const Pose& T_map_imu) {
  const ScanSums sums = sum_by_cubes(correspondences, T_map_imu, false);
  MapError result;
  result.position = T_map_imu.position;
  if (sums.cubes.size() < kFewestCubes) return result;

  Matrix6 information = sums.information;
  // Keeps the factorization defined along directions that no point constrains.
  information.diagonal() *= 1.0 + 1e-9;
  const Eigen::LDLT<Matrix6> factor(information);
  if (factor.info() != Eigen::Success || !factor.isPositive()) return result;
  result.inverse = factor.solve(Matrix6::Identity());
  // Residuals at the scan's own fit: the error of another pose estimate would repeat from scan to scan.
  const Vector6 fit = -result.inverse * sums.gradient;
  for (const CubeSums& cube : sums.cubes) {
    const double scale = 1.0 / (1.0 / (kWellKnown_m * kWellKnown_m) + cube.weight.trace());
    const Vector3 residual = cube.residual + cube.coupling.transpose() * fit;
    result.cubes.push_back(
        {cube.key, cube.center, scale * residual, scale * cube.weight, cube.coupling, scale * cube.coupling});
  }
  result.cells = joined_in_cells(result.cubes);
  return result;
}

}  // namespace lodestone

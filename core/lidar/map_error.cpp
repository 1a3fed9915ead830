#include "core/lidar/map_error.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <map>

#include "core/geometry/so3.h"
#include "core/lidar/prefetch_plane.h"

namespace lodestone {

namespace {

/// The share of an edge by which faces of cubes lie beside round coordinates.
constexpr double kFirstFace = 0.382;

constexpr std::size_t kFewestCubes = 4;

/// Scans with more cubes use pairs of cells: a twentieth of the pairs. Far away, cells resolve as finely as cubes in a
/// room.
constexpr std::size_t kManyCubes = 150;

/// The finer parts contain errors of planes, of sensors and of moved objects; these do not displace the place.
constexpr int kFirstPartOfPlaces = 2;

/// A cube whose mean offset has a smaller sigma counts fully in the estimate of the variance.
constexpr double kWellKnown_m = 0.005;

struct Cube {
  Matrix3 turn = Matrix3::Zero();          // Σ w (a × n) (a × n)ᵀ
  Matrix6x3 coupling = Matrix6x3::Zero();  // Σ w J nᵀ, J = [a × n; n]
  Matrix3 weight = Matrix3::Zero();        // Σ w n nᵀ
  Vector3 turned = Vector3::Zero();        // Σ w (a × n) r
  Vector3 residual = Vector3::Zero();      // Σ w n r
  Vector3 center = Vector3::Zero();        // Σ w c
  double weights = 0.0;
};

Matrix6 symmetric(const Matrix6& matrix) {
  return 0.5 * (matrix + matrix.transpose());
}

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

MapErrorCube map_error_cube(const Vector3& place) {
  MapErrorCube cube;
  for (int axis = 0; axis < 3; ++axis) {
    cube[static_cast<std::size_t>(axis)] = static_cast<int>(std::floor(place[axis] / kMapErrorCube_m + kFirstFace));
  }
  return cube;
}

MapErrorCube cell_of(const MapErrorCube& cube) {
  return {cube[0] >> 1, cube[1] >> 1, cube[2] >> 1};  // rounds down (C++20)
}

double map_error_correlation(double squared_distance_m2, int part) {
  const double length_m = map_error_length_m(part);
  const double exponent = 0.5 * squared_distance_m2 / (length_m * length_m);
  return exponent > 12.0 ? 0.0 : std::exp(-exponent);
}

LongMapError MapError::long_error(const MapErrorVariances& variances_m2) const {
  const std::vector<PlaceOffset>& places = cubes.size() <= kManyCubes ? cubes : cells;
  std::vector<Matrix6x3> moved;
  moved.reserve(places.size());
  for (const PlaceOffset& place : places) moved.push_back(inverse * place.coupling);
  LongMapError result;
  double variance = 0.0;
  double weighed = 0.0;
  for (int part = 1; part < kMapErrorParts; ++part) {
    if (!(variances_m2[part] > 0.0) || places.empty()) continue;
    const double length_m = map_error_length_m(part);
    Matrix6 covariance = Matrix6::Zero();
    for (std::size_t i = 0; i < places.size(); ++i) {
      Matrix6x3 sum = 0.5 * moved[i];  // each pair once
      for (std::size_t j = 0; j < i; ++j) {
        const double correlation = map_error_correlation((places[i].center - places[j].center).squaredNorm(), part);
        if (correlation > 0.0) sum += correlation * moved[j];
      }
      if (part >= kFirstPartOfPlaces) {
        const Vector3 away = places[i].center - position;
        const double correlation = map_error_correlation(away.squaredNorm(), part);
        Matrix6x3 place;
        place.topRows<3>() = 0.5 * correlation / (length_m * length_m) * so3::hat(away);
        place.bottomRows<3>() = correlation * Matrix3::Identity();
        sum -= place;
      }
      const Matrix6 product = moved[i] * sum.transpose();
      covariance += product + product.transpose();
    }
    if (part >= kFirstPartOfPlaces) {
      covariance.diagonal().head<3>().array() += 0.5 / (length_m * length_m);
      covariance.diagonal().tail<3>().array() += 1.0;
    }
    covariance *= variances_m2[part];
    result.covariance += covariance;
    const double own = covariance.bottomRightCorner<3, 3>().trace();
    variance += own;
    weighed += own * length_m;
  }
  if (variance > 0.0) result.length_m = weighed / variance;
  return result;
}

Matrix6 pose_error_root(const Matrix6& covariance) {
  constexpr double kLeast = 1e-6;
  const Eigen::LLT<Matrix6> root(covariance + kLeast * kLeast * Matrix6::Identity());
  if (root.info() != Eigen::Success) return kLeast * Matrix6::Identity();
  return root.matrixL();
}

MapError analyse_map_error(std::span<const Correspondence> correspondences, const Pose& T_map_imu) {
  const Matrix3 rotation = T_map_imu.rotation.toRotationMatrix();
  // Ordered, so that sums are the same on every machine.
  std::map<MapErrorCube, Cube> cubes;
  MapErrorCube last_key{};
  Cube* last = nullptr;
  for (std::size_t i = 0; i < correspondences.size(); ++i) {
    prefetch_plane(correspondences, i);
    const Correspondence& match = correspondences[i];
    const Vector3 normal = match.plane->normal.cast<double>();
    const Vector3 arm = rotation * match.point.cast<double>();
    const Vector3 center = match.plane->center.cast<double>();
    const MapErrorCube key = map_error_cube(center);
    if (last == nullptr || key != last_key) {
      last = &cubes[key];
      last_key = key;
    }
    const double once = match.variance_once > 0.0F ? static_cast<double>(match.variance_once) : 0.0;
    const double weight = static_cast<double>(match.robust_weight) / (once > 0.0 ? once : match.variance);
    const Vector3 turn = arm.cross(normal);
    const Vector3 weighed = weight * normal;
    const double residual = normal.dot(arm + T_map_imu.position - center);
    last->turn.noalias() += (weight * turn) * turn.transpose();
    last->coupling.topRows<3>().noalias() += turn * weighed.transpose();
    last->weight.noalias() += weighed * normal.transpose();
    last->turned += (weight * residual) * turn;
    last->residual += residual * weighed;
    last->center += weight * center;
    last->weights += weight;
  }
  Matrix6 information = Matrix6::Zero();
  Vector6 gradient = Vector6::Zero();
  for (auto& [key, cube] : cubes) {
    cube.coupling.bottomRows<3>() = cube.weight;
    information.topLeftCorner<3, 3>() += cube.turn;
    information.rightCols<3>() += cube.coupling;
    information.bottomLeftCorner<3, 3>() += cube.coupling.topRows<3>().transpose();
    gradient.head<3>() += cube.turned;
    gradient.tail<3>() += cube.residual;
  }
  MapError result;
  result.position = T_map_imu.position;
  if (cubes.size() < kFewestCubes) return result;

  // Keeps the factorization defined along directions that no point constrains.
  information.diagonal() *= 1.0 + 1e-9;
  const Eigen::LDLT<Matrix6> factor(information);
  if (factor.info() != Eigen::Success || !factor.isPositive()) return result;
  result.inverse = factor.solve(Matrix6::Identity());
  // Residuals at the scan's own fit: the error of another pose estimate would repeat from scan to scan.
  const Vector6 fit = -result.inverse * gradient;
  for (const auto& [key, cube] : cubes) {
    if (!(cube.weights > 0.0)) continue;
    const double scale = 1.0 / (1.0 / (kWellKnown_m * kWellKnown_m) + cube.weight.trace());
    const Vector3 residual = cube.residual + cube.coupling.transpose() * fit;
    result.cubes.push_back(
        {key, cube.center / cube.weights, scale * residual, scale * cube.weight, cube.coupling, scale * cube.coupling});
    const Matrix6x3 moved = result.inverse * cube.coupling;
    result.cube_covariance += moved * moved.transpose();
  }
  result.cube_covariance = symmetric(result.cube_covariance);
  result.cells = joined_in_cells(result.cubes);
  return result;
}

}  // namespace lodestone

#include "core/lidar/map_error.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <map>

namespace lodestone {

namespace {

using Key = std::array<int, 3>;

constexpr std::size_t kFewestCubes = 4;
constexpr double kLeastLeft = 0.02;

/// A cube whose points know their mean better than this counts fully in the estimate of the variance.
constexpr double kWellKnown_m = 0.005;

Key key_of(const Vector3& position) {
  return {static_cast<int>(std::floor(position.x() / kMapErrorCube_m)),
          static_cast<int>(std::floor(position.y() / kMapErrorCube_m)),
          static_cast<int>(std::floor(position.z() / kMapErrorCube_m))};
}

struct Cube {
  Matrix6x3 coupling = Matrix6x3::Zero();  // Σ w J nᵀ
  Matrix3 weight = Matrix3::Zero();        // Σ w n nᵀ
  Vector3 residual = Vector3::Zero();      // Σ w n r
};

}  // namespace

Matrix6 MapError::pose_error_root_of(double variance_m2) const {
  constexpr double kLeast = 1e-6;
  const Matrix6 covariance = variance_m2 * pose_covariance + kLeast * kLeast * Matrix6::Identity();
  const Eigen::LLT<Matrix6> root(covariance);
  if (root.info() != Eigen::Success) return kLeast * Matrix6::Identity();
  return root.matrixL();
}

MapError analyse_map_error(std::span<const Correspondence> correspondences, const Pose& T_map_seen) {
  const Matrix3 rotation = T_map_seen.rotation.toRotationMatrix();
  // Ordered: the same sums on every machine.
  std::map<Key, Cube> cubes;
  Matrix6 information = Matrix6::Zero();
  Key last_key{};
  Cube* last = nullptr;
  for (const Correspondence& match : correspondences) {
    const Vector3 normal = match.plane->normal.cast<double>();
    const Vector3 arm = rotation * match.point.cast<double>();
    const Vector3 center = match.plane->center.cast<double>();
    const Key key = key_of(center);
    if (last == nullptr || key != last_key) {
      last = &cubes[key];
      last_key = key;
    }
    const double once = match.variance_once > 0.0F ? static_cast<double>(match.variance_once) : 0.0;
    const double weight = static_cast<double>(match.robust_weight) / (once > 0.0 ? once : match.variance);
    Vector6 jacobian;
    jacobian << arm.cross(normal), normal;
    const Vector3 weighed = weight * normal;
    last->coupling.noalias() += jacobian * weighed.transpose();
    last->weight.noalias() += weighed * normal.transpose();
    last->residual += weighed * normal.dot(arm + T_map_seen.position - center);
    information.noalias() += (weight * jacobian) * jacobian.transpose();
  }
  MapError result;
  if (cubes.size() < kFewestCubes) return result;

  // Keeps the factorization defined along a direction that no point sees.
  information.diagonal() *= 1.0 + 1e-9;
  const Eigen::LDLT<Matrix6> factor(information);
  if (factor.info() != Eigen::Success || !factor.isPositive()) return result;
  result.inverse = factor.solve(Matrix6::Identity());
  Matrix6 covariance = Matrix6::Zero();
  for (const auto& [key, cube] : cubes) {
    const double scale = 1.0 / (1.0 / (kWellKnown_m * kWellKnown_m) + cube.weight.trace());
    result.cubes.push_back({key, scale * cube.residual, scale * cube.weight, cube.coupling, scale * cube.coupling});
    const Matrix6x3 moved = result.inverse * cube.coupling;
    covariance += moved * moved.transpose();
  }
  result.pose_covariance = 0.5 * (covariance + covariance.transpose());
  return result;
}

std::optional<MapErrorMoments> compare_map_errors(const MapError& a, const MapError& b) {
  Matrix6 by_pose = Matrix6::Zero();
  double alone = 0.0;
  double mixed = 0.0;
  double main = 0.0;
  std::size_t common = 0;
  MapErrorMoments result;
  auto other = b.cubes.begin();
  for (const CubeOffset& cube : a.cubes) {
    while (other != b.cubes.end() && other->cube < cube.cube) ++other;
    if (other == b.cubes.end()) break;
    if (other->cube != cube.cube) continue;
    ++common;
    result.product_m2 += cube.offset_m.dot(other->offset_m);
    by_pose += cube.by_pose * cube.by_pose.transpose();
    main += cube.gain.cwiseProduct(other->gain).sum();
    alone += cube.gain.squaredNorm();
    mixed += (cube.by_pose.transpose() * a.inverse * cube.coupling * cube.gain.transpose()).trace();
  }
  if (common < kFewestCubes) return std::nullopt;

  // Less what the pose takes up of a displacement of the cubes (docs/design/042).
  const double taken = by_pose.cwiseProduct(a.pose_covariance).sum();
  const double left = alone > 0.0 ? (alone - 2.0 * mixed + taken) / alone : 1.0;
  result.gain = main * std::clamp(left, kLeastLeft, 1.0);
  if (!(result.gain > 0.0)) return std::nullopt;
  return result;
}

double MapErrorMoments::variance_m2() const {
  return gain > 0.0 ? std::max(0.0, product_m2 / gain) : 0.0;
}

}  // namespace lodestone

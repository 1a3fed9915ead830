#include "core/lidar/map_error.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <map>

namespace lodestone {

namespace {

using Matrix6x3 = Eigen::Matrix<double, 6, 3>;

constexpr std::size_t kFewestCubes = 4;
constexpr double kLeastLeft = 0.1;

/// A cube whose points know their mean better than this counts fully in the estimate of the variance.
constexpr double kWellKnown_m = 0.005;

struct Cube {
  Matrix6x3 coupling = Matrix6x3::Zero();  // Σ w J nᵀ
  Matrix3 weight = Matrix3::Zero();        // Σ w n nᵀ
  Vector3 residual = Vector3::Zero();      // Σ w n r
};

}  // namespace

Matrix6 MapError::pose_error_root_of(double sigma_m) const {
  constexpr double kLeast = 1e-6;
  const Matrix6 covariance = sigma_m * sigma_m * pose_covariance + kLeast * kLeast * Matrix6::Identity();
  const Eigen::LLT<Matrix6> root(covariance);
  if (root.info() != Eigen::Success) return kLeast * Matrix6::Identity();
  return root.matrixL();
}

MapError analyse_map_error(std::span<const Correspondence> correspondences, const Pose& T_map_seen) {
  const Matrix3 rotation = T_map_seen.rotation.toRotationMatrix();
  // Ordered: the same sums on every machine.
  std::map<std::array<int, 3>, Cube> cubes;
  Matrix6 information = Matrix6::Zero();
  std::array<int, 3> last_key{};
  Cube* last = nullptr;
  for (const Correspondence& match : correspondences) {
    const Vector3 normal = match.plane->normal.cast<double>();
    const Vector3 arm = rotation * match.point.cast<double>();
    const Vector3 offset = match.plane->center.cast<double>();
    const std::array<int, 3> key{static_cast<int>(std::floor(offset.x() / kMapErrorCube_m)),
                                 static_cast<int>(std::floor(offset.y() / kMapErrorCube_m)),
                                 static_cast<int>(std::floor(offset.z() / kMapErrorCube_m))};
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
    last->residual += weighed * normal.dot(arm + T_map_seen.position - offset);
    information.noalias() += (weight * jacobian) * jacobian.transpose();
  }
  MapError result;
  if (cubes.size() < kFewestCubes) return result;

  // Keeps the factorization defined along a direction that no point sees.
  information.diagonal() *= 1.0 + 1e-9;
  const Eigen::LDLT<Matrix6> factor(information);
  if (factor.info() != Eigen::Success || !factor.isPositive()) return result;
  const Matrix6 inverse = factor.solve(Matrix6::Identity());
  Matrix6 shared = Matrix6::Zero();
  Matrix6 shared_scaled = Matrix6::Zero();
  Matrix6 mixed_scaled = Matrix6::Zero();
  double by_unit = 0.0;
  for (const auto& [key, cube] : cubes) {
    const double scale = 1.0 / (1.0 / (kWellKnown_m * kWellKnown_m) + cube.weight.trace());
    const Matrix6 own = cube.coupling * cube.coupling.transpose();
    shared += own;
    shared_scaled += scale * scale * own;
    mixed_scaled += scale * scale * cube.coupling * cube.weight * cube.coupling.transpose();
    by_unit += scale * scale * cube.weight.squaredNorm();
    result.cubes.push_back({key, scale * cube.residual, scale * cube.weight});
  }
  // What the pose takes up of a displacement of the cubes (docs/design/042).
  const double left =
      by_unit - 2.0 * (inverse * mixed_scaled).trace() + (inverse * shared * inverse * shared_scaled).trace();
  result.left_share = by_unit > 0.0 ? std::clamp(left / by_unit, kLeastLeft, 1.0) : 1.0;
  const Matrix6 covariance = inverse * shared * inverse;
  result.pose_covariance = 0.5 * (covariance + covariance.transpose());
  return result;
}

std::optional<double> repeated_variance(const MapError& a, const MapError& b) {
  double products = 0.0;
  double gains = 0.0;
  std::size_t common = 0;
  auto other = b.cubes.begin();
  for (const CubeOffset& cube : a.cubes) {
    while (other != b.cubes.end() && other->cube < cube.cube) ++other;
    if (other == b.cubes.end()) break;
    if (other->cube != cube.cube) continue;
    products += cube.offset_m.dot(other->offset_m);
    gains += cube.gain.cwiseProduct(other->gain).sum();
    ++common;
  }
  if (common < kFewestCubes || !(gains > 0.0)) return std::nullopt;
  return products / (gains * std::sqrt(a.left_share * b.left_share));
}

}  // namespace lodestone

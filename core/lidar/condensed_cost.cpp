#include "core/lidar/condensed_cost.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <array>
#include <cmath>

#include "core/lidar/moment_products.h"
#include "core/lidar/prefetch_plane.h"
#include "core/parallel.h"

namespace lodestone {

namespace {

constexpr int kChunks = 16;

struct Chunk {
  MomentProducts products;
  double weight_sum = 0.0;
  double range_squared = 0.0;
  Matrix6 spurious = Matrix6::Zero();
};

void accumulate(std::span<const Correspondence> part, const Vector3& centroid, const Vector3& anchor,
                const Matrix3& map_to_imu, Chunk& chunk) {
  for (std::size_t i = 0; i < part.size(); ++i) {
    prefetch_plane(part, i);
    const Correspondence& match = part[i];
    const Vector3 n = match.plane->normal.cast<double>();
    const Vector3 p = match.point.cast<double>() - centroid;
    const double d = n.dot(anchor - match.plane->center.cast<double>());
    const double w = static_cast<double>(match.weight());
    chunk.products.add(n, p, d, w);
    chunk.weight_sum += w;
    const Vector3 lever = match.point.cast<double>();
    chunk.range_squared += lever.squaredNorm();
    // A wrong normal n + e makes J wrong by A e, A = [hat(p) Rᵀ; I]; on average that adds A Cov(e) Aᵀ.
    const auto add_spurious = [&](const Vector3& axis, double variance) {
      Vector6 error;
      error.head<3>() = lever.cross(map_to_imu * axis);
      error.tail<3>() = axis;
      chunk.spurious.noalias() += (w * variance * error) * error.transpose();
    };
    const Vector3 major = match.plane->major.cast<double>();
    add_spurious(major, match.plane->major_tilt_variance);
    add_spurious(n.cross(major), match.plane->minor_tilt_variance);
  }
}

}  // namespace

CondensedCost condense(std::span<const Correspondence> correspondences, const Pose& T_map_imu) {
  CondensedCost result;
  result.count = static_cast<int>(correspondences.size());
  result.anchor = T_map_imu.position;
  if (correspondences.empty()) return result;
  for (const Correspondence& match : correspondences) result.centroid += match.point.cast<double>();
  result.centroid /= static_cast<double>(correspondences.size());
  result.anchor = T_map_imu * result.centroid;

  const Matrix3 map_to_imu = T_map_imu.rotation.toRotationMatrix().transpose();
  std::array<Chunk, kChunks> chunks;
  const std::size_t size = (correspondences.size() + kChunks - 1) / kChunks;
  parallel_for(0, kChunks, [&](int i) {
    const std::size_t begin = std::min(correspondences.size(), size * static_cast<std::size_t>(i));
    const std::size_t end = std::min(correspondences.size(), begin + size);
    accumulate(correspondences.subspan(begin, end - begin), result.centroid, result.anchor, map_to_imu,
               chunks[static_cast<std::size_t>(i)]);
  });
  Chunk sum;
  for (const Chunk& chunk : chunks) {
    sum.products += chunk.products;
    sum.weight_sum += chunk.weight_sum;
    sum.range_squared += chunk.range_squared;
    sum.spurious += chunk.spurious;
  }
  result.moment = sum.products.moment();
  result.weight_sum = sum.weight_sum;
  result.range_rms_m = std::sqrt(sum.range_squared / static_cast<double>(correspondences.size()));
  result.spurious_information = sum.spurious;
  return result;
}

Vector13 CondensedCost::coordinates(const Pose& T_map_imu) const {
  const Matrix3 rotation = T_map_imu.rotation.toRotationMatrix();
  Vector13 xi;
  xi.head<9>() = Eigen::Map<const Eigen::Matrix<double, 9, 1>>(rotation.data());
  xi.segment<3>(9) = rotation * centroid + T_map_imu.position - anchor;
  xi[12] = 1.0;
  return xi;
}

Matrix13x6 CondensedCost::coordinates_jacobian(const Pose& T_map_imu) const {
  const Matrix3 rotation = T_map_imu.rotation.toRotationMatrix();
  Matrix13x6 jacobian = Matrix13x6::Zero();
  // R Exp(φ) ≈ R + R hat(φ): column j of R moves by R (φ × e_j) = −R hat(e_j) φ.
  for (int j = 0; j < 3; ++j) jacobian.block<3, 3>(3 * j, 0) = -rotation * so3::hat(Vector3::Unit(j));
  jacobian.block<3, 3>(9, 0) = -rotation * so3::hat(centroid);
  jacobian.block<3, 3>(9, 3) = Matrix3::Identity();
  return jacobian;
}

double CondensedCost::cost(const Pose& T_map_imu) const {
  const Vector13 xi = coordinates(T_map_imu);
  return xi.dot(moment * xi);
}

Matrix6 CondensedCost::hessian(const Pose& T_map_imu) const {
  const Matrix13x6 jacobian = coordinates_jacobian(T_map_imu);
  return jacobian.transpose() * moment * jacobian;
}

Vector6 CondensedCost::gradient(const Pose& T_map_imu) const {
  return coordinates_jacobian(T_map_imu).transpose() * (moment * coordinates(T_map_imu));
}

Matrix6 CondensedCost::seen_share(const Pose& T_map_imu) const {
  Matrix6 information = hessian(T_map_imu);
  // Keeps the factorization defined along directions that no point constrains.
  information.diagonal() *= 1.0 + 1e-9;
  const Eigen::GeneralizedSelfAdjointEigenSolver<Matrix6> shares(spurious_information, information);
  if (shares.info() != Eigen::Success) return Matrix6::Identity();
  const Vector6 seen = (1.0 - shares.eigenvalues().array()).cwiseMax(0.0).cwiseMin(1.0);
  const Matrix6& directions = shares.eigenvectors();  // Vᵀ H V = I
  return directions * seen.asDiagonal() * directions.transpose() * information;
}

}  // namespace lodestone

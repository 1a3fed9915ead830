#include "core/observability/degeneracy.h"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "core/observability/information_noise.h"

namespace lodestone {

namespace {

/// Share of LiDAR information kept at `ratio` = predicted sigma over the limit.
double kept_share(double ratio, MaskKind mask) {
  if (mask == MaskKind::hard) return ratio > 1.0 ? 0.0 : 1.0;
  if (!std::isfinite(ratio)) return 0.0;
  const double squared = ratio * ratio;
  return 1.0 / (1.0 + squared * squared);
}

Vector6 scaling(double lever_arm_m) {
  Vector6 scale;
  scale << lever_arm_m, lever_arm_m, lever_arm_m, 1.0, 1.0, 1.0;
  return scale;
}

Degeneracy decompose(const Matrix6& information, double lever_arm_m) {
  Degeneracy result;
  result.lever_arm_m = lever_arm_m;
  const Vector6 inverse_scale = scaling(lever_arm_m).cwiseInverse();
  const Matrix6 scaled = inverse_scale.asDiagonal() * information * inverse_scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Matrix6> solver(0.5 * (scaled + scaled.transpose()));
  // Rounding leaves up to this share of the largest eigenvalue in directions without information.
  const double floor = 1e-12 * std::max(solver.eigenvalues()[5], 0.0);
  for (int i = 0; i < 6; ++i) {
    const int from = 5 - i;
    const double eigenvalue = solver.eigenvalues()[from];
    result.directions.col(i) = solver.eigenvectors().col(from);
    result.sigma_m[i] = eigenvalue > floor ? 1.0 / std::sqrt(eigenvalue) : std::numeric_limits<double>::infinity();
  }
  return result;
}

void apply_limit(double limit, MaskKind mask, Degeneracy& result) {
  result.degenerate_directions = 0;
  for (int i = 0; i < 6; ++i) {
    const double ratio = result.sigma_m[i] / limit;
    result.kept[i] = kept_share(ratio, mask);
    if (ratio > 1.0) ++result.degenerate_directions;
  }
}

/// Gram-Schmidt by QR; the signs are those of the columns.
Eigen::MatrixXd orthonormal(const Eigen::MatrixXd& columns) {
  const Eigen::HouseholderQR<Eigen::MatrixXd> factor(columns);
  Eigen::MatrixXd basis = factor.householderQ() * Eigen::MatrixXd::Identity(columns.rows(), columns.cols());
  for (Eigen::Index i = 0; i < basis.cols(); ++i) {
    if (basis.col(i).dot(columns.col(i)) < 0.0) basis.col(i) *= -1.0;
  }
  return basis;
}

bool is_hard(const Degeneracy& mask) {
  const int degenerate = mask.degenerate_directions;
  return (degenerate == 6 || mask.kept.head(6 - degenerate).minCoeff() == 1.0) &&
         (degenerate == 0 || mask.kept.tail(degenerate).maxCoeff() == 0.0);
}

/// The same analysis with other degenerate directions. The observable directions are projected orthogonally to these
/// and keep their order.
Degeneracy with_degenerate_directions(const Degeneracy& degeneracy, const Eigen::MatrixXd& degenerate) {
  Degeneracy result = degeneracy;
  const Eigen::MatrixXd observed = degeneracy.directions.leftCols(6 - degenerate.cols());
  result.directions.rightCols(degenerate.cols()) = degenerate;
  result.directions.leftCols(6 - degenerate.cols()) =
      orthonormal(observed - degenerate * (degenerate.transpose() * observed));
  return result;
}

}  // namespace

Matrix6 Degeneracy::lidar_projector() const {
  if (degenerate_directions == 0 && kept.minCoeff() == 1.0) return Matrix6::Identity();
  const Vector6 scale = scaling(lever_arm_m);
  return scale.cwiseInverse().asDiagonal() * (directions * kept.asDiagonal() * directions.transpose()) *
         scale.asDiagonal();
}

Slide Degeneracy::slide(const Pose& pose) const {
  if (degenerate_directions != 1) return {};
  return Slide::along(scaling(lever_arm_m).cwiseInverse().asDiagonal() * directions.col(5), pose);
}

Degeneracy no_degeneracy() {
  return {};
}

Degeneracy analyse_by_sigma(const Matrix6& information, double lever_arm_m, const DegeneracyOptions& options) {
  Degeneracy result = decompose(information, lever_arm_m);
  apply_limit(options.max_sigma_m, options.mask, result);
  return result;
}

Degeneracy analyse_by_eigenvalue(const Matrix6& unit_hessian, const DegeneracyOptions& options) {
  Degeneracy result = decompose(unit_hessian, 1.0);
  apply_limit(1.0 / std::sqrt(options.paper_threshold), options.mask, result);
  return result;
}

Degeneracy analyse_by_probability(const Matrix6& information, const Matrix6& spurious,
                                  std::span<const Correspondence> correspondences, const Pose& T_map_imu,
                                  double lever_arm_m, const DegeneracyOptions& options, const NormalNoise& assumed) {
  const Degeneracy analysed = decompose(information, lever_arm_m);
  const Matrix6 motions = scaling(lever_arm_m).cwiseInverse().asDiagonal() * analysed.directions;  // φ, p
  const InformationNoise noise = information_noise(correspondences, T_map_imu, motions);
  const double level = 1.0 / (options.max_sigma_m * options.max_sigma_m);
  std::array<double, 6> probability{};
  for (int i = 0; i < 6; ++i) {
    const Vector6 motion = motions.col(i);
    const double relative_variance = (noise.mean[i] > 0.0 ? noise.variance[i] / (noise.mean[i] * noise.mean[i]) : 0.0) +
                                     assumed.level_uncertainty * assumed.level_uncertainty;
    const double mean = std::max(0.0, motion.dot(spurious * motion));
    const double spread = mean * std::sqrt(relative_variance);
    // Without the noise, the measured information must reach the level and be a multiple of the noise.
    const double measured = motion.dot(information * motion) + mean;
    const double margin = std::min(measured - level, measured / (1.0 + assumed.min_signal_to_noise)) - mean;
    probability[static_cast<std::size_t>(i)] =
        spread > 0.0 ? 0.5 * std::erfc(-margin / (std::sqrt(2.0) * spread)) : (margin >= 0.0 ? 1.0 : 0.0);
  }
  std::array<int, 6> order{};
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
    return probability[static_cast<std::size_t>(a)] > probability[static_cast<std::size_t>(b)];
  });
  Degeneracy result = analysed;
  for (int i = 0; i < 6; ++i) {
    const int from = order[static_cast<std::size_t>(i)];
    const double share = probability[static_cast<std::size_t>(from)];
    const bool degenerate = share < options.min_probability;
    result.directions.col(i) = analysed.directions.col(from);
    result.sigma_m[i] = analysed.sigma_m[from];
    result.kept[i] = options.mask == MaskKind::soft ? share : (degenerate ? 0.0 : 1.0);
    if (degenerate) ++result.degenerate_directions;
  }
  return result;
}

Degeneracy without_tilt(const Degeneracy& degeneracy, const Vector3& up) {
  const int degenerate = degeneracy.degenerate_directions;
  if (degenerate == 0 || degenerate == 6 || !is_hard(degeneracy)) return degeneracy;
  Eigen::MatrixXd basis = degeneracy.directions.rightCols(degenerate);
  const Eigen::RowVectorXd turn = up.transpose() * basis.topRows<3>();
  basis.topRows<3>() = (up * turn).eval();
  if (basis.colwise().norm().minCoeff() < std::cos(0.5)) return degeneracy;
  return with_degenerate_directions(degeneracy, orthonormal(basis));
}

Degeneracy follow(const Degeneracy& now, const Pose& pose_now, const Degeneracy& before, const Pose& pose_before,
                  double gain) {
  const int degenerate = now.degenerate_directions;
  if (degenerate == 0 || degenerate == 6 || before.degenerate_directions != degenerate || !is_hard(now) ||
      !is_hard(before)) {
    return now;
  }
  // A rigid motion of the map: rotation ω about the old position and translation t. At the new pose the motion is
  // R_nowᵀ ω and t + ω × (p_now − p_before).
  Matrix6 carry = Matrix6::Identity();
  const Matrix3 to_map = pose_before.rotation.toRotationMatrix();
  carry.topLeftCorner<3, 3>() = pose_now.rotation.toRotationMatrix().transpose() * to_map;
  carry.bottomLeftCorner<3, 3>() = -so3::hat(pose_now.position - pose_before.position) * to_map;
  const Eigen::MatrixXd carried = scaling(now.lever_arm_m).asDiagonal() * carry *
                                  scaling(before.lever_arm_m).cwiseInverse().asDiagonal() *
                                  before.directions.rightCols(degenerate);
  const Eigen::MatrixXd old_basis = orthonormal(carried);
  const Eigen::MatrixXd new_basis = now.directions.rightCols(degenerate);
  const Eigen::MatrixXd difference = old_basis - new_basis * (new_basis.transpose() * old_basis);
  if (difference.colwise().norm().maxCoeff() > 0.2) return now;

  return with_degenerate_directions(now, orthonormal(old_basis - gain * difference));
}

}  // namespace lodestone

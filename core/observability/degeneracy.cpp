#include "core/observability/degeneracy.h"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <limits>

namespace lodestone {

namespace {

/// Share of LiDAR kept at `ratio` = predicted sigma over the limit.
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
  // Rounding alone leaves this much of the largest eigenvalue in directions that hold nothing.
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

}  // namespace

Matrix6 Degeneracy::lidar_projector() const {
  if (degenerate_directions == 0 && kept.minCoeff() == 1.0) return Matrix6::Identity();
  const Vector6 scale = scaling(lever_arm_m);
  return scale.cwiseInverse().asDiagonal() * (directions * kept.asDiagonal() * directions.transpose()) *
         scale.asDiagonal();
}

Degeneracy no_degeneracy() { return {}; }

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

}  // namespace lodestone

#include "factors/condensed_lidar_factor.h"

#include "core/lidar/square_root.h"
#include "factors/manifolds.h"

namespace lodestone {

using Matrix19x6 = Eigen::Matrix<double, 19, 6>;

CondensedLidarFactor::CondensedLidarFactor(const CondensedScan& scan, const PoseMask& mask, bool has_before) {
  set_num_residuals(19);
  *mutable_parameter_block_sizes() = {7, 9};
  if (has_before) mutable_parameter_block_sizes()->push_back(7);
  set(scan, mask);
}

void CondensedLidarFactor::set(const CondensedScan& scan, const PoseMask& mask) {
  cost_ = scan.cost;
  deskewing_ = scan.deskewing;
  root_ = square_root(has_before() ? scan.swept.given_both : scan.swept.given_end);
  mask_ = mask;
}

bool CondensedLidarFactor::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  const bool derive = jacobians != nullptr;
  const Pose end = to_pose(parameters[0]);
  const Pose before = has_before() ? to_pose(parameters[2]) : Pose{};
  Deskewing::Jacobians by_states;
  Matrix6 seen_by_end;
  const Pose seen = mask_.apply(end, derive ? &seen_by_end : nullptr);
  const Vector6 rates = deskewing_.rates(has_before() ? &before.rotation : nullptr, end.rotation, Vector3(parameters[1]),
                                         derive ? &by_states : nullptr);
  Vector19 coordinates;
  coordinates << cost_.coordinates(seen), mask_.hide(rates);
  Eigen::Map<Vector19>{residuals} = root_ * coordinates;
  if (!derive) return true;

  const Matrix19x6 by_rates = mask_.hide_from(root_.rightCols<6>());
  if (jacobians[0] != nullptr) {
    Matrix19x6 by_end = root_.leftCols<13>() * cost_.coordinates_jacobian(seen);
    if (mask_.active()) by_end = (by_end * seen_by_end).eval();
    by_end.leftCols<3>() += by_rates.leftCols<3>() * by_states.turn_by_end + by_rates.rightCols<3>() * by_states.shift_by_end;
    to_ambient(parameters[0], by_end, jacobians[0]);
  }
  if (jacobians[1] != nullptr) {
    Eigen::Map<Eigen::Matrix<double, 19, 9, Eigen::RowMajor>> by_motion{jacobians[1]};
    by_motion.setZero();
    by_motion.leftCols<3>() = -by_rates.rightCols<3>();
  }
  if (has_before() && jacobians[2] != nullptr) {
    Matrix19x6 by_before = Matrix19x6::Zero();
    by_before.leftCols<3>() = by_rates.leftCols<3>() * by_states.turn_by_before;
    to_ambient(parameters[2], by_before, jacobians[2]);
  }
  return true;
}

}  // namespace lodestone

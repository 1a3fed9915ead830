#include "factors/condensed_lidar_factor.h"

#include "core/lidar/square_root.h"
#include "factors/manifolds.h"

namespace lodestone {

namespace {

using Matrix25x3 = Eigen::Matrix<double, 25, 3>;
using Matrix25x6 = Eigen::Matrix<double, 25, 6>;

NavState state_of(const double* pose, const double* motion) {
  NavState state;
  state.T_map_imu = to_pose(pose);
  state.velocity = Vector3(motion);
  return state;
}

void to_motion(const Matrix25x3& by_velocity, double* ambient) {
  Eigen::Map<Eigen::Matrix<double, 25, 9, Eigen::RowMajor>> by_motion{ambient};
  by_motion.setZero();
  by_motion.leftCols<3>() = by_velocity;
}

}  // namespace

CondensedLidarFactor::CondensedLidarFactor(const CondensedScan& scan, const PoseMask& mask, bool has_before) {
  set_num_residuals(25);
  *mutable_parameter_block_sizes() = {7, 9};
  if (has_before) mutable_parameter_block_sizes()->insert(mutable_parameter_block_sizes()->end(), {7, 9});
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
  const NavState end = state_of(parameters[0], parameters[1]);
  const NavState before = has_before() ? state_of(parameters[2], parameters[3]) : NavState{};
  Deskewing::Jacobians by_states;
  Matrix6 seen_by_end;
  const Pose seen = mask_.apply(end.T_map_imu, derive ? &seen_by_end : nullptr);
  const Vector12 departure = deskewing_.departure(has_before() ? &before : nullptr, end, derive ? &by_states : nullptr);
  Vector25 coordinates;
  coordinates << cost_.coordinates(seen), mask_.hide_departure(departure);
  Eigen::Map<Vector25>{residuals} = root_ * coordinates;
  if (!derive) return true;

  const Eigen::Matrix<double, 25, 12> by_departure = mask_.hide_departure_from(root_.rightCols<12>());
  if (jacobians[0] != nullptr) {
    Matrix25x6 by_end = root_.leftCols<13>() * cost_.coordinates_jacobian(seen);
    if (mask_.active()) by_end = (by_end * seen_by_end).eval();
    by_end += by_departure * by_states.by_end;
    to_ambient(parameters[0], by_end, jacobians[0]);
  }
  if (jacobians[1] != nullptr) to_motion(by_departure * by_states.by_end_velocity, jacobians[1]);
  if (!has_before()) return true;
  if (jacobians[2] != nullptr) to_ambient(parameters[2], by_departure * by_states.by_before, jacobians[2]);
  if (jacobians[3] != nullptr) to_motion(by_departure * by_states.by_before_velocity, jacobians[3]);
  return true;
}

}  // namespace lodestone

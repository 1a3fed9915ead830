#include "factors/condensed_lidar_factor.h"

#include <array>

#include "core/lidar/square_root.h"
#include "factors/manifolds.h"

namespace lodestone {

namespace {

constexpr std::array<int, 3> kInMapAxes{3, 6, 9};  // slopes and shift of a departure

using Matrix25x3 = Eigen::Matrix<double, 25, 3>;
using Matrix25x9 = Eigen::Matrix<double, 25, 9>;
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

CondensedLidarFactor::CondensedLidarFactor(const CondensedScan& scan, const PoseMask& mask, const Blocks& blocks)
    : blocks_(blocks) {
  set_num_residuals(25);
  std::vector<int>& sizes = *mutable_parameter_block_sizes();
  sizes = {7, 9};
  if (blocks.before) sizes.insert(sizes.end(), {7, 9});
  if (blocks.calibration) sizes.push_back(7);
  if (blocks.map_error) sizes.push_back(6);
  set(scan, mask);
}

void CondensedLidarFactor::set(const CondensedScan& scan, const PoseMask& mask) {
  scan_ = scan;
  root_ = square_root(blocks_.before ? scan.swept.given_both : scan.swept.given_end);
  mask_ = mask;
}

SeenPose CondensedLidarFactor::seen(const Pose& T_map_imu, const double* calibration, const double* map_error) const {
  SeenPose result = see(scan_, T_map_imu, calibration);
  if (scan_.by_lidar && map_error != nullptr) move_by(Vector6(map_error), result);
  return result;
}

Vector6 CondensedLidarFactor::rate_at(const NavState& state) const {
  Vector6 result = Vector6::Zero();
  if (scan_.deskewing.step_s > 0.0) result << end_rates_.turn_rate, state.velocity;
  return result;
}

bool CondensedLidarFactor::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  const std::size_t calibration = blocks_.before ? 4 : 2;
  const std::size_t map_error = calibration + (blocks_.calibration ? 1 : 0);
  const double* mounting = blocks_.calibration ? parameters[calibration] : nullptr;
  const double* error = blocks_.map_error ? parameters[map_error] : nullptr;
  // States at both ends of the step in the scan's terms: the scan was deskewed as a rigid motion of the LiDAR.
  const Deskewing& deskewing = scan_.deskewing;
  const SeenState end(scan_, state_of(parameters[0], parameters[1]), end_rates_, mounting);
  const SeenState before(scan_, blocks_.before ? state_of(parameters[2], parameters[3]) : NavState{}, before_rates_,
                         mounting);
  const bool derive = jacobians != nullptr;
  const Vector6 map_error_there = error == nullptr ? Vector6::Zero().eval() : Vector6(error);
  const PoseMask::Seen masked = mask_.see(end.state.T_map_imu, map_error_there);
  Deskewing::Jacobians by_states;
  Vector12 departure =
      deskewing.departure(blocks_.before ? &before.state : nullptr, end.state, derive ? &by_states : nullptr);
  for (const int part : kInMapAxes) departure.segment<3>(part) = masked.turned * departure.segment<3>(part);
  Vector25 coordinates;
  coordinates << scan_.cost.coordinates(masked.pose), mask_.hide_departure(departure);
  Eigen::Map<Vector25>{residuals} = root_ * coordinates;
  if (!derive) return true;

  Eigen::Matrix<double, 25, 12> by_departure = mask_.hide_departure_from(root_.rightCols<12>());
  Matrix25x3 by_turned = Matrix25x3::Zero();
  for (const int part : kInMapAxes) {
    by_turned -= by_departure.middleCols<3>(part) * so3::hat(departure.segment<3>(part));
    by_departure.middleCols<3>(part) *= masked.turned.toRotationMatrix();
  }
  const Matrix25x6 by_masked = root_.leftCols<13>() * scan_.cost.coordinates_jacobian(masked.pose);
  Matrix25x9 by_seen_end;
  by_seen_end << by_masked * masked.by_pose + by_turned * masked.turned_by_pose + by_departure * by_states.by_end,
      by_departure * by_states.by_end_velocity;
  Matrix25x9 by_seen_before;
  by_seen_before << by_departure * by_states.by_before, by_departure * by_states.by_before_velocity;
  const auto to_blocks = [&](const Matrix25x9& by_state, std::size_t pose) {
    if (jacobians[pose] != nullptr) to_ambient(parameters[pose], by_state.leftCols<6>().eval(), jacobians[pose]);
    if (jacobians[pose + 1] != nullptr) to_motion(by_state.rightCols<3>(), jacobians[pose + 1]);
  };
  to_blocks(by_seen_end * end.by_state, 0);
  if (blocks_.before) to_blocks(by_seen_before * before.by_state, 2);
  if (blocks_.calibration && jacobians[calibration] != nullptr) {
    Eigen::Map<Eigen::Matrix<double, 25, 7, Eigen::RowMajor>>{jacobians[calibration]} =
        by_seen_end * end.by_calibration + by_seen_before * before.by_calibration;
  }
  if (blocks_.map_error && jacobians[map_error] != nullptr) {
    Eigen::Map<Eigen::Matrix<double, 25, 6, Eigen::RowMajor>>{jacobians[map_error]} =
        by_masked * masked.by_error + by_turned * masked.turned_by_error;
  }
  return true;
}

}  // namespace lodestone

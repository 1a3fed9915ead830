#include "estimators/ieskf/swept_evidence.h"

#include <Eigen/Cholesky>

#include "core/lidar/swept_cost.h"

namespace lodestone {

namespace {

using Matrix9 = Eigen::Matrix<double, 9, 9>;
using Matrix22 = Eigen::Matrix<double, 22, 22>;

// Order of what the state explains: [ξ; slope at the end; error of the rate; error of the acceleration].
constexpr int kSlope = 13;
constexpr int kRate = 16;
constexpr int kAcceleration = 19;
constexpr int kExplained = 22;

/// The quadratic form (moment matrix) of what the state explains. The departure at the begin of the step follows from
/// it, up to the IMU's noise over the step, which is marginalized.
Matrix22 explained_moment(const Matrix25& given_both, const Deskewing& deskewing) {
  constexpr int turn = 13, end_slope = 16, shift = 19, begin_slope = 22;  // of given_both
  const double step_s = deskewing.step_s;
  const auto times = [](double factor) -> Matrix3 { return factor * Matrix3::Identity(); };
  Eigen::Matrix<double, 25, kExplained + 9> order = Eigen::Matrix<double, 25, kExplained + 9>::Zero();
  order.topLeftCorner<13, 13>().setIdentity();
  order.block<3, 3>(end_slope, kSlope) = times(1.0);
  order.block<3, 3>(shift, kSlope) = times(step_s);
  order.block<3, 3>(begin_slope, kSlope) = times(1.0);
  order.block<3, 3>(turn, kRate) = times(step_s);
  order.block<3, 3>(shift, kAcceleration) = times(0.5 * step_s * step_s);
  order.block<3, 3>(begin_slope, kAcceleration) = times(step_s);
  order.block<3, 3>(turn, kExplained) = times(1.0);
  order.block<3, 3>(shift, kExplained + 3) = times(1.0);
  order.block<3, 3>(begin_slope, kExplained + 6) = times(1.0);
  const Eigen::Matrix<double, kExplained + 9, kExplained + 9> all = order.transpose() * given_both * order;
  const Matrix9 inner = all.bottomRightCorner<9, 9>() + step_information(deskewing);
  const Eigen::Matrix<double, kExplained, 9> border = all.topRightCorner<kExplained, 9>();
  return all.topLeftCorner<kExplained, kExplained>() - border * inner.llt().solve(border.transpose());
}

}  // namespace

PoseEvidence masked_evidence(const CondensedCost& cost, const Pose& T_map_imu, const Matrix6& mask) {
  return {mask.transpose() * cost.hessian(T_map_imu) * mask, mask.transpose() * cost.gradient(T_map_imu)};
}

StateEvidence swept_evidence(const CondensedCost& cost, std::span<const Correspondence> correspondences,
                             const Pose& condensed_at, const NavState& deskewed, const Deskewing& deskewing,
                             const NavState& state, const Matrix6& mask) {
  if (correspondences.empty() || deskewing.step_s <= 0.0) {
    return masked_evidence(cost, state.T_map_imu, mask);
  }
  const Matrix22 moment = explained_moment(sweep(cost, correspondences, condensed_at, deskewing).given_both, deskewing);
  Deskewing::Jacobians departure_by;
  const Vector12 departure = deskewing.departure(nullptr, state, &departure_by);
  const Matrix3 to_map = state.T_map_imu.rotation.toRotationMatrix();
  const Vector3 bias_change = state.accelerometer_bias - deskewed.accelerometer_bias;
  Eigen::Matrix<double, kExplained, 1> explained;
  explained << cost.coordinates(state.T_map_imu), departure.segment<3>(3),
      state.gyroscope_bias - deskewed.gyroscope_bias, state.gravity - deskewed.gravity - to_map * bias_change;

  // Slopes and accelerations are shifts, rates are rotations: each uses the pose's observable directions.
  const Matrix3 seen_turns = mask.topLeftCorner<3, 3>();
  const Matrix3 seen_shifts = mask.bottomRightCorner<3, 3>();
  Eigen::Matrix<double, kExplained, 17> jacobian = Eigen::Matrix<double, kExplained, 17>::Zero();
  jacobian.block<13, 6>(0, tangent::rotation) = cost.coordinates_jacobian(state.T_map_imu) * mask;
  jacobian.block<3, 6>(kSlope, tangent::rotation) = seen_shifts * departure_by.by_end.middleRows<3>(3);
  jacobian.block<3, 3>(kSlope, tangent::velocity) = seen_shifts * departure_by.by_end_velocity.middleRows<3>(3);
  jacobian.block<3, 3>(kRate, tangent::gyroscope_bias) = seen_turns;
  jacobian.block<3, 3>(kAcceleration, tangent::rotation) = seen_shifts * to_map * so3::hat(bias_change);
  jacobian.block<3, 3>(kAcceleration, tangent::accelerometer_bias) = -seen_shifts * to_map;
  jacobian.block<3, 2>(kAcceleration, tangent::gravity) = seen_shifts * s2::boxplus_jacobian(state.gravity);
  StateEvidence result;
  result.information = jacobian.transpose() * moment * jacobian;
  result.gradient = jacobian.transpose() * (moment * explained);
  return result;
}

}  // namespace lodestone

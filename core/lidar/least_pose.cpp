#include "core/lidar/least_pose.h"

#include <Eigen/Cholesky>

#include "core/lidar/bent_map.h"

namespace lodestone {

namespace {

/// The Gauss-Newton step to the least of a quadratic cost.
Vector6 step_to_least(const Matrix6& information, const Vector6& gradient) {
  Matrix6 sum = information;
  sum.diagonal().head<3>().array() += 1.0 / (kUnknownTurn_rad * kUnknownTurn_rad);
  sum.diagonal().tail<3>().array() += 1.0 / (kUnknownPlace_m * kUnknownPlace_m);
  return -sum.llt().solve(gradient);
}

/// T with ξ(`motion` · x) = T ξ(x).
Matrix13 coordinates_moved_by(const Pose& motion, const CondensedCost& cost) {
  Matrix13 result = Matrix13::Zero();
  const Matrix3 rotation = motion.rotation.toRotationMatrix();
  for (int i = 0; i < 4; ++i) result.block<3, 3>(3 * i, 3 * i) = rotation;
  result.block<3, 1>(9, 12) = motion * cost.anchor - cost.anchor;
  result(12, 12) = 1.0;
  return result;
}

}  // namespace

void keep_least_pose(CondensedScan& scan, const Pose& T_map_imu) {
  const CondensedCost& cost = scan.cost;
  const Vector13 coordinates = cost.coordinates(T_map_imu);
  const Matrix13x6 by_pose = cost.coordinates_jacobian(T_map_imu);
  const Vector6 wanted = step_to_least(cost.hessian(T_map_imu), cost.gradient(T_map_imu));
  for (Matrix25* swept : {&scan.swept.given_both, &scan.swept.given_end}) {
    const Eigen::Matrix<double, 13, 6> weighed = swept->topLeftCorner<13, 13>() * by_pose;
    const Matrix6 information = by_pose.transpose() * weighed;
    const Vector6 gradient_there = weighed.transpose() * coordinates + information * wanted;
    const Vector6 least = wanted + step_to_least(information, gradient_there);
    const Pose motion = T_map_imu.boxplus(least) * T_map_imu.boxplus(wanted).inverse();
    const Matrix13 moved = coordinates_moved_by(motion, cost);
    swept->topRows<13>() = (moved.transpose() * swept->topRows<13>()).eval();
    swept->leftCols<13>() = (swept->leftCols<13>() * moved).eval();
  }
}

}  // namespace lodestone

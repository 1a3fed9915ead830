#pragma once

#include <Eigen/Cholesky>
#include <algorithm>
#include <span>
#include <vector>

#include "core/lidar/association.h"
#include "core/lidar/condensed_cost.h"

namespace lodestone {

/// Result of registering a scan to a map.
struct Registration {
  Pose pose;           ///< T_map_imu
  CondensedCost cost;  ///< of the last association
  int iterations = 0;
};

/// Gauss-Newton on the condensed cost with new correspondences in each iteration: LiDAR alone, without prediction. The
/// assumed uncertainty of the pose, and with it the distance gate, decreases from `start_sigma_m` to 1 cm.
inline Registration register_points(std::span<const Eigen::Vector3f> points, const Pose& start, const PlaneMap& map,
                                    const LidarModel& lidar, AssociationOptions options, double start_sigma_m = 0.5) {
  constexpr double kEndSigmaM = 0.01;
  constexpr double kRotationPerMetre = 0.1;  // rad: at points ten metres away
  const double gate_m = options.max_distance_m;
  Registration result{start, {}, 0};
  for (double sigma_m = start_sigma_m; result.iterations < 60; sigma_m = std::max(kEndSigmaM, 0.7 * sigma_m)) {
    ++result.iterations;
    options.max_distance_m = std::max(gate_m, 2.0 * sigma_m);
    Matrix6 covariance = Matrix6::Identity() * sigma_m * sigma_m;
    covariance.topLeftCorner<3, 3>() *= kRotationPerMetre * kRotationPerMetre;
    result.cost = condense(associate(points, result.pose, covariance, map, lidar, options), result.pose);
    const Vector6 step = -result.cost.hessian(result.pose).ldlt().solve(result.cost.gradient(result.pose));
    result.pose = result.pose.boxplus(step);
    if (sigma_m <= kEndSigmaM && step.head<3>().norm() < 1e-6 && step.tail<3>().norm() < 1e-5) break;
  }
  return result;
}

}  // namespace lodestone

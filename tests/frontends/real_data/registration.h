#pragma once

#include <Eigen/Cholesky>
#include <span>
#include <vector>

#include "core/registration/condensed_cost.h"
#include "frontends/lidar/association.h"

namespace lodestone {

/// Where a scan came to lie on a map.
struct Registration {
  Pose pose;           ///< T_map_imu
  CondensedCost cost;  ///< of the last association
  int iterations = 0;
};

/// Gauss-Newton on the condensed cost with new correspondences at each iteration, the distance gate narrowed from
/// `wide_gate_m` to that of `options`: LiDAR alone, no prediction.
inline Registration register_points(std::span<const Eigen::Vector3f> points, const Pose& start, const PlaneMap& map,
                                    const LidarModel& lidar, AssociationOptions options, double wide_gate_m = 1.0) {
  const double gate_m = options.max_distance_m;
  options.max_distance_m = std::max(gate_m, wide_gate_m);
  Registration result{start, {}, 0};
  while (result.iterations < 60) {
    ++result.iterations;
    result.cost = condense(associate(points, result.pose, map, lidar, options), result.pose);
    const Vector6 step = -result.cost.hessian(result.pose).ldlt().solve(result.cost.gradient(result.pose));
    result.pose = result.pose.boxplus(step);
    const bool narrow = options.max_distance_m <= gate_m;
    if (narrow && step.head<3>().norm() < 1e-6 && step.tail<3>().norm() < 1e-5) break;
    options.max_distance_m = std::max(gate_m, 0.8 * options.max_distance_m);
  }
  return result;
}

}  // namespace lodestone

#pragma once

#include <span>
#include <vector>

#include "core/geometry/pose.h"
#include "core/lidar/correspondence.h"
#include "core/lidar/plane_map.h"
#include "core/lidar/scan_lidars.h"
#include "core/option_checks.h"
#include "core/sensor_suite.h"

namespace lodestone {

struct AssociationOptions {
  double max_distance_m = 0.3;
  double gate_sigmas = 4.0;
  double surface_roughness_m = 0.002;
  double map_error_repeats = 10.0;

  template <class Visitor>
  void visit(Visitor& visitor) {
    visitor.field("max_distance_m", max_distance_m, "a point farther than this from its plane is rejected");
    visitor.field(
        "gate_sigmas", gate_sigmas,
        "a point is rejected if its residual exceeds this many sigmas; the sigma includes that of the predicted pose");
    visitor.field("surface_roughness_m", surface_roughness_m,
                  "sigma of the roughness of real surfaces, added to the noise of each point");
    visitor.field(
        "map_error_repeats", map_error_repeats,
        "averaging scans does not reduce the error of the map's planes: a plane's variance is multiplied by this "
        "factor; not used by the smoother, in which the map's errors are states");
  }

  void check() const {
    option_checks::positive("max_distance_m", max_distance_m);
    option_checks::positive("gate_sigmas", gate_sigmas);
    option_checks::positive("surface_roughness_m", surface_roughness_m);
    option_checks::not_negative("map_error_repeats", map_error_repeats);
  }
};

/// Finds each point's plane at the pose `T_map_imu`, and the variance of its residual. `points`: imu frame at the
/// scan's end. The variance of r = nᵀ (R p + t − q) is the sum of: the range noise along the normal and the beam's
/// angular noise across it (both of the LiDAR that measured the point, from its mounting), the surface roughness, and
/// the variance of the plane's fit, `map_error_repeats` times (docs/design/004).
/// `pose_covariance` (φ, p): of `T_map_imu`; it widens the gate (docs/design/006). `variance_scale`: the ratio of the
/// log's own residuals to those that sensor and plane explain (residual_scale). Points keep their order; the result
/// does not depend on threads. `ages_s`: time from each point to the scan's end; empty if irrelevant. Throws
/// std::invalid_argument if `lidars` does not match `points`.
std::vector<Correspondence> associate(std::span<const Eigen::Vector3f> points, const Pose& T_map_imu,
                                      const Matrix6& pose_covariance, const PlaneMap& map, const ScanLidars& lidars,
                                      const AssociationOptions& options, std::span<const float> ages_s = {},
                                      double variance_scale = 1.0);

/// Mean of r² at the pose over its variance by sensor and plane, with the plane's error counted once. 1: residuals are
/// as large as sensor and plane explain. 0: no points.
double normalized_residuals(std::span<const Correspondence> correspondences, const Pose& T_map_imu);

/// As normalized_residuals, but robust: the median of r² over its variance, over the median of χ² with one degree of
/// freedom (0.455). 0: no points.
double residual_scale(std::span<const Correspondence> correspondences, const Pose& T_map_imu);

/// Σ JᵀJ with weight one on metres, order φ, p: the matrix of the paper's rule.
Matrix6 unit_hessian(std::span<const Correspondence> correspondences, const Pose& T_map_imu);

}  // namespace lodestone

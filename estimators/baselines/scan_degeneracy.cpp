#include "estimators/baselines/scan_degeneracy.h"

#include <memory>
#include <vector>

#include "core/imu/scan_motion.h"
#include "core/lidar/association.h"
#include "core/lidar/condensed_cost.h"
#include "core/lidar/deskew.h"
#include "core/lidar/scan_sampling.h"
#include "core/lidar/voxel_planes.h"
#include "core/observability/single_scan.h"

namespace lodestone {

namespace {

constexpr double kFarthestPoint_m = 1000.0;  // of a LiDAR, from the robot

bool is_within_reach(const EstimatorInput& input, const NavState& state) {
  return has_voxels_around(*input.planes, state.T_map_imu.position) && state.T_map_imu.rotation.coeffs().allFinite() &&
         state.velocity.allFinite();
}

std::vector<Correspondence> correspondences_of(const EstimatorInput& input, const ScanBundle& bundle,
                                               const Estimate& estimate) {
  if (bundle.imu.empty() || !is_within_reach(input, estimate.state)) return {};
  const LidarOptions& options = input.options.lidar;
  const std::vector<LidarPoint> sampled = registration_points(bundle, input.suite.lidars(), options.sampling);
  const std::vector<Eigen::Vector3f> points =
      deskew(sampled, bundle.scan.start, ScanMotion(estimate.state, bundle.imu), input.suite.lidar.T_imu_lidar);
  const Pose& pose = estimate.state.T_map_imu;
  const std::shared_ptr<const PlaneMap> planes = input.planes->around(pose.position);
  return associate(points, pose, estimate.covariance, *planes, ScanLidars(input.suite.lidars(), sampled),
                   options.association, {});
}

}  // namespace

bool has_voxels_around(const PlaneMapSource& planes, const Vector3& position) {
  return (position.array().abs() < voxels_reach_m(planes.voxel_m()) - kFarthestPoint_m).all();
}

Degeneracy scan_degeneracy(const EstimatorInput& input, const ScanBundle& bundle, const Estimate& estimate) {
  const std::vector<Correspondence> correspondences = correspondences_of(input, bundle, estimate);
  if (correspondences.empty()) return analyse_scan({}, {}, {});  // the pose may not be finite
  const Pose& pose = estimate.state.T_map_imu;
  return analyse_scan(condense(correspondences, pose), pose, {});
}

void set_degeneracy(const EstimatorInput& input, const ScanBundle& bundle, Estimate& estimate) {
  if (input.planes == nullptr) return;
  const Degeneracy found = scan_degeneracy(input, bundle, estimate);
  Diagnostics& diagnostics = estimate.diagnostics;
  diagnostics.direction_sigma_m = found.sigma_m;
  diagnostics.degenerate_directions = found.degenerate_directions;
  diagnostics.unobserved_directions = unobserved_directions(found);
}

}  // namespace lodestone

#include "estimators/baselines/scan_degeneracy.h"

#include <algorithm>

#include "core/imu/scan_motion.h"
#include "core/lidar/condensed_cost.h"
#include "core/lidar/deskew.h"

namespace lodestone {

Degeneracy scan_degeneracy(const EstimatorInput& input, const ScanBundle& bundle, const NavState& state) {
  const LidarOptions& options = input.options.lidar;
  const Pose& pose = state.T_map_imu;
  const std::vector<LidarPoint> sampled = sample_scan(bundle.scan, input.suite.lidars(), options.sampling);
  const std::vector<Eigen::Vector3f> points =
      deskew(sampled, bundle.scan.start, ScanMotion(state, bundle.imu), input.suite.lidar.T_imu_lidar);
  const std::shared_ptr<const PlaneMap> planes = input.planes->around(pose.position);
  const std::vector<Correspondence> correspondences = associate(
      points, pose, Matrix6::Zero(), *planes, ScanLidars(input.suite.lidars(), sampled), options.association, {});
  const CondensedCost cost = condense(correspondences, pose);
  return analyse_by_sigma(cost.hessian(pose) - kNormalNoiseMargin * cost.spurious_information,
                          std::max(cost.range_rms_m, 1.0), DegeneracyOptions{});
}

void judge_degeneracy(const EstimatorInput& input, const ScanBundle& bundle, Estimate& estimate) {
  if (bundle.scan.points.empty() || bundle.imu.empty() || input.planes == nullptr) return;
  const Degeneracy found = scan_degeneracy(input, bundle, estimate.state);
  estimate.diagnostics.direction_sigma_m = found.sigma_m;
  estimate.diagnostics.degenerate_directions = found.degenerate_directions;
}

}  // namespace lodestone

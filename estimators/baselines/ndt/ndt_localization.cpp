#include "estimators/baselines/ndt/ndt_localization.h"

#include <algorithm>
#include <limits>

#include "core/lidar/range_limits.h"
#include "core/stopwatch.h"
#include "estimators/baselines/scan_degeneracy.h"

namespace lodestone {

namespace {

/// Points within the range limits, imu frame, metres, without deskewing.
std::vector<Eigen::Vector3f> rigid_scan(const LidarScan& scan, const SensorSuite& suite) {
  const std::vector<RangeLimits> limits = range_limits_of(suite.lidars());
  const Eigen::Matrix3f rotation = suite.lidar.T_imu_lidar.rotation.toRotationMatrix().cast<float>();
  const Eigen::Vector3f position = suite.lidar.T_imu_lidar.position.cast<float>();
  std::vector<Eigen::Vector3f> points;
  points.reserve(scan.points.size());
  for (const LidarPoint& point : scan.points) {
    if (limits.at(point.lidar).hold(point)) points.push_back(rotation * point.position + position);
  }
  return points;
}

}  // namespace

NdtLocalization::NdtLocalization(EstimatorInput input, std::shared_ptr<ScanMatcher> matcher, NdtFilterOptions options)
    : input_(std::move(input)), matcher_(std::move(matcher)), options_(options) {}

void NdtLocalization::process(const ScanBundle& bundle, EstimateSink& sink) {
  const Stopwatch step;
  if (!filter_) {
    filter_.emplace(
        initial_state(input_.initial_pose, input_.initial_velocity, input_.suite.gravity_m_s2, input_.options.initial));
  }
  const Time first = bundle.imu.front().time;
  const Time last = bundle.imu.back().time;
  const Time length = bundle.scan.end - bundle.scan.start;
  const Time registered =
      std::clamp(bundle.scan.start + static_cast<Time>(options_.pose_time * static_cast<double>(length)), first, last);
  Estimate estimate;
  estimate.time = bundle.scan.end;
  predict(bundle.imu, first, registered);
  correct(bundle.scan, estimate.diagnostics);
  predict(bundle.imu, registered, last);
  estimate.state = filter_->state();
  estimate.covariance = filter_->pose_covariance();
  set_degeneracy(input_, bundle, estimate);
  estimate.diagnostics.step_ms = step.elapsed_ms();
  sink.causal(estimate);
  sink.best(estimate);
}

void NdtLocalization::predict(std::span<const ImuSample> imu, Time from, Time to) {
  for (std::size_t i = 1; i < imu.size(); ++i) {
    const double duration_s = to_seconds(std::min(imu[i].time, to) - std::max(imu[i - 1].time, from));
    if (duration_s <= 0.0) continue;
    filter_->predict(make_interval(imu[i - 1], imu[i], Vector3::Zero(), Vector3::Zero()), duration_s);
  }
}

void NdtLocalization::correct(const LidarScan& scan, Diagnostics& diagnostics) {
  const std::vector<Eigen::Vector3f> points = rigid_scan(scan, input_.suite);
  if (points.empty()) return;
  const std::optional<ScanMatch> match = matcher_->match(points, filter_->state().T_map_imu);
  if (!match) return;
  filter_->correct(match->T_map_imu);
  diagnostics.points = match->points;
  diagnostics.correspondences = match->matched;
  diagnostics.inlier_share = static_cast<double>(match->matched) / match->points;
  diagnostics.lidar_rmse_m = std::numeric_limits<double>::quiet_NaN();  // no planes, no distances from them
  diagnostics.iterations = match->iterations;
}

}  // namespace lodestone

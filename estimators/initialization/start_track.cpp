#include "estimators/initialization/start_track.h"

#include "core/imu/propagation.h"
#include "core/imu/scan_motion.h"
#include "estimators/ieskf/ieskf.h"
#include "estimators/initialization/scan_pair.h"
#include "estimators/initialization/scan_registration.h"
#include "estimators/initialization/start_scan.h"
#include "estimators/verdict.h"

namespace lodestone {

namespace {

constexpr double kPositionSigma_m = 0.15;
constexpr double kRotationSigma_deg = 1.0;
constexpr double kVelocitySigma_m_s = 1.5;

EstimatorInput open_start(EstimatorInput input, const Pose& pose_at_start) {
  input.initial_pose = pose_at_start;
  input.initial_velocity = Vector3::Zero();
  input.warnings = nullptr;                    // problems of a wrong hypothesis are no warnings of the run
  input.options.lidar.sampling.voxel_m = 0.0;  // keeps all points
  InitialOptions& initial = input.options.initial;
  initial.position_sigma_m = kPositionSigma_m;
  initial.rotation_sigma_deg = kRotationSigma_deg;
  initial.velocity_sigma_m_s = kVelocitySigma_m_s;
  return input;
}

/// Stores the states of a run.
class StateSink : public EstimateSink {
 public:
  StateSink(std::vector<NavState>& states, bool& lost) : states_(states), lost_(lost) {}
  void causal(const Estimate& estimate) override {
    states_.push_back(estimate.state);
    lost_ = lost_ || judge_covariance(estimate).health == Health::lost;
  }
  void best(const Estimate&) override {}

 private:
  std::vector<NavState>& states_;
  bool& lost_;
};

}  // namespace

StartTracking tracking_of(std::span<const ScanBundle> bundles) {
  if (bundles.size() < 2) return StartTracking::filter;
  const double period_s = to_seconds(bundles[1].scan.end - bundles[0].scan.end);
  return kVelocitySigma_m_s * period_s > kConverges_m ? StartTracking::pairs : StartTracking::filter;
}

StartTrack::StartTrack(const EstimatorInput& input, const Pose& pose_at_start, StartTracking tracking)
    : input_(&input), pose_at_start_(pose_at_start) {
  if (tracking == StartTracking::filter) {
    filter_ = std::make_shared<IteratedFilter>(open_start(input, pose_at_start));
  }
}

void StartTrack::follow(std::span<const ScanBundle> bundles) {
  StateSink sink(states_, lost_);
  for (const ScanBundle& bundle : bundles) {
    if (filter_ != nullptr) {
      filter_->process(bundle, sink);
    } else {
      follow_in_pairs(bundle);
    }
  }
}

void StartTrack::follow_in_pairs(const ScanBundle& bundle) {
  if (states_.empty()) {
    NavState still;
    still.T_map_imu = pose_at_start_;
    still.gravity = Vector3(0.0, 0.0, -input_->suite.gravity_m_s2);
    const Pose T_start_end = ScanMotion(still, bundle.imu).relative_pose(bundle.scan.start).inverse();
    still.T_map_imu = pose_at_start_ * T_start_end;
    states_.push_back(still);
    since_.push_back(bundle);
    return;
  }
  since_.push_back(bundle);
  states_.push_back(propagate(states_.back(), bundle.imu, input_->suite.imu, nullptr));
  if (bundle.scan.points.size() < kLeastStartPoints) return;
  const auto first = states_.end() - static_cast<std::ptrdiff_t>(since_.size());
  const PairMotion motion = find_motion(since_, *first, kVelocitySigma_m_s, *input_);
  *first = motion.first;
  states_.back() = motion.second;
  since_.erase(since_.begin(), since_.end() - 1);
}

}  // namespace lodestone

#include "estimators/initialization/start_track.h"

#include "estimators/health/health_monitor.h"
#include "estimators/ieskf/ieskf.h"

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

StartTrack::StartTrack(const EstimatorInput& input, const Pose& pose_at_start)
    : filter_(std::make_shared<IteratedFilter>(open_start(input, pose_at_start))) {}

void StartTrack::follow(std::span<const ScanBundle> bundles) {
  StateSink sink(states_, lost_);
  for (const ScanBundle& bundle : bundles) filter_->process(bundle, sink);
}

}  // namespace lodestone

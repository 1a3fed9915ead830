#include "estimators/baselines/magnetic_calibrating/magnetic_calibrating.h"

#include <numeric>

#include "core/imu/propagation.h"
#include "core/stopwatch.h"
#include "estimators/initial_state.h"

namespace lodestone {

MagneticCalibrating::MagneticCalibrating(EstimatorInput input, const MagneticCalibratingOptions& options)
    : input_(std::move(input)), options_(options) {}

void MagneticCalibrating::process(const ScanBundle& bundle, EstimateSink& sink) {
  const Stopwatch step;
  predict(bundle);
  Estimate estimate;
  estimate.time = bundle.scan.end;
  measure(bundle, estimate.diagnostics);
  estimate.diagnostics.iterations = window_->alternate(options_.alternations);
  const CalibratingWindow::Fit fit = window_->newest_fit();
  estimate.diagnostics.magnetic_weight = fit.weight;
  estimate.diagnostics.magnetic_residual_ut = fit.residual_rms_ut;

  const SlidingWindow& window = window_->window();
  const std::size_t newest = window.size() - 1;
  const bool leaves = newest > 0 && to_seconds(window.time(newest) - window.time(0)) >= options_.window_s - 1e-6;
  std::vector<std::size_t> wanted{newest};
  if (leaves) wanted.push_back(0);
  const std::vector<Matrix6> covariances = window.pose_covariances(wanted);
  estimate.state = window.state(newest);
  estimate.covariance = covariances[0];
  estimates_.push_back(estimate);
  if (leaves) {
    report(0, covariances[1], sink);
    window_->marginalize_oldest();
  }
  estimate.diagnostics.step_ms = step.elapsed_ms();
  sink.causal(estimate);
}

void MagneticCalibrating::predict(const ScanBundle& bundle) {
  if (window_ != nullptr) {
    const SlidingWindow& window = window_->window();
    const NavState predicted = propagate(window.state(window.size() - 1), bundle.imu, input_.suite.imu, nullptr);
    window_->add_keyframe(bundle.scan.end, predicted, bundle.imu);
    return;
  }
  InitialState start =
      initial_state(input_.initial_pose, input_.initial_velocity, input_.suite.gravity_m_s2, input_.options.initial);
  const NavState state = propagate(start.state, bundle.imu, input_.suite.imu, &start.covariance);
  window_ = std::make_unique<CalibratingWindow>(bundle.scan.end, state, start.covariance, input_.suite, input_.field,
                                                input_.options.magnetic);
}

void MagneticCalibrating::measure(const ScanBundle& bundle, Diagnostics& diagnostics) {
  const SlidingWindow& window = window_->window();
  const NavState state = window.state(window.size() - 1);
  const std::vector<ArrayReading> arrays = average_array(bundle.magnetic, ScanMotion(state, bundle.imu), input_.suite,
                                                         input_.options.magnetic.samples_per_reading);
  const double step_s = to_seconds(bundle.imu.back().time - bundle.imu.front().time);
  const double spacing_m = state.velocity.norm() * step_s / std::max(1.0, static_cast<double>(arrays.size()));
  const FieldStatistics statistics = window_->set_readings(arrays, spacing_m);
  diagnostics.magnetic_samples = statistics.arrays;
  diagnostics.magnetic_off_map = statistics.off_map;
}

void MagneticCalibrating::report(std::size_t k, const Matrix6& covariance, EstimateSink& sink) {
  Estimate estimate = estimates_.front();
  estimates_.pop_front();
  estimate.state = window_->window().state(k);
  estimate.covariance = covariance;
  sink.best(estimate);
}

void MagneticCalibrating::finish(EstimateSink& sink) {
  if (window_ == nullptr) return;
  const SlidingWindow& window = window_->window();
  std::vector<std::size_t> all(window.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  const std::vector<Matrix6> covariances = window.pose_covariances(all);
  for (const std::size_t k : all) report(k, covariances[k], sink);
  calibration_ = window.calibration_estimate();
}

}  // namespace lodestone

#pragma once

#include <deque>
#include <memory>

#include "estimators/baselines/magnetic_calibrating/calibrating_window.h"
#include "estimators/baselines/magnetic_calibrating/magnetic_calibrating_options.h"
#include "estimators/factory.h"

namespace lodestone {

/// RoSLAC (Lyu et al. 2026): localizes the magnetometer array in the field map and calibrates each magnetometer, in
/// alternation over a sliding window, with a robust loss (docs/design/055-magnetic-calibrating.md). The IMU predicts
/// and connects the poses; scans, cloud map and wheels are not used.
class MagneticCalibrating final : public Estimator {
 public:
  /// `input` must have a field map.
  MagneticCalibrating(EstimatorInput input, const MagneticCalibratingOptions& options);

  void process(const ScanBundle& bundle, EstimateSink& sink) override;
  void finish(EstimateSink& sink) override;
  std::string solver() const override { return SlidingWindow::solver_description(); }

  /// Misalignment and soft iron of the magnetometers.
  const CalibrationEstimate* calibration() const override { return &calibration_; }

 private:
  void predict(const ScanBundle& bundle);
  void measure(const ScanBundle& bundle, Diagnostics& diagnostics);
  void report(std::size_t k, const Matrix6& covariance, EstimateSink& sink);

  EstimatorInput input_;
  MagneticCalibratingOptions options_;
  std::unique_ptr<CalibratingWindow> window_;
  std::deque<Estimate> estimates_;  // causal, of the window's keyframes
  CalibrationEstimate calibration_;
};

}  // namespace lodestone

#pragma once

#include <vector>

#include "core/lidar/association.h"
#include "estimators/baselines/continuous_time/continuous_time_options.h"
#include "estimators/baselines/continuous_time/localizability_sampling.h"
#include "estimators/baselines/continuous_time/motion_state.h"
#include "estimators/factory.h"

namespace lodestone {

/// CTE-MLO (Shen et al., IEEE Transactions on Field Robotics 2025) in a prior map: LiDAR only. The trajectory is a
/// Gaussian process whose angular acceleration and jerk are white noise. A scan is divided into windows of 10 ms. Each
/// window predicts the state at its end and corrects it by the point-to-plane residuals of its points, each at its own
/// time. IMU, magnetometers and wheels are not used. docs/design/057-continuous-time.md
class ContinuousTime final : public Estimator {
 public:
  /// `input.planes` must not be null.
  ContinuousTime(EstimatorInput input, const ContinuousTimeOptions& options);

  void process(const ScanBundle& bundle, EstimateSink& sink) override;
  void finish(EstimateSink& sink) override;

 private:
  struct Window;
  struct Sums;
  std::vector<Window> divide(const LidarScan& scan) const;
  void keep_localizing(Window& window);
  void update(Window& window, Sums& sums);

  EstimatorInput input_;
  ContinuousTimeOptions options_;
  AssociationOptions association_;
  std::vector<LidarModel> lidars_;
  LocalizabilitySampling sampling_;
  bool started_ = false;
  Time time_ = 0;  // of the state
  MotionState state_;
  Matrix15 covariance_ = Matrix15::Identity();
};

}  // namespace lodestone

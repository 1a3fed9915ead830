#pragma once

#include "core/imu/integration.h"
#include "estimators/baselines/ndt/unscented_filter.h"
#include "estimators/initial_state.h"

namespace lodestone {

/// The unscented Kalman filter of hdl_localization (Koide et al. 2019). State, 16: position (map, m), velocity (map,
/// m/s), quaternion w x y z, accelerometer bias (m/s²), gyroscope bias (rad/s). The quaternion is a vector of four
/// numbers with additive errors, normalized wherever it is used. Equations and noise: docs/design/056-ndt.md.
class PoseFilter {
 public:
  explicit PoseFilter(const InitialState& start);

  /// Predicts over `duration_s` with constant readings. `imu`: as measured; its biases are not subtracted.
  void predict(const ImuInterval& imu, double duration_s);

  /// Corrects by a measured T_map_imu of fixed covariance.
  void correct(const Pose& measured);

  /// Gravity is that of the start.
  NavState state() const;

  /// Of the pose, 6 × 6, tangent order φ, p.
  Matrix6 pose_covariance() const;

 private:
  Quaternion rotation() const;

  GaussianState state_;
  Vector3 gravity_;
};

}  // namespace lodestone

#pragma once

#include <deque>
#include <span>

#include "core/geometry/pose.h"
#include "factors/field_factor.h"

namespace lodestone {

/// The field error that all magnetometers of an array share over a metre of the path: a map surveyed at wrong places,
/// motors, steel that moved. More readings within the metre do not reduce it. Its variance is estimated from the log:
/// squared mean residual of the array over each metre, less the part from sensor noise. The median over the last metres
/// is used, because residuals at a wrong pose must not increase the variance.
class FieldError {
 public:
  static constexpr int kMetres = 50;  ///< whose median is used

  /// Adds the readings of a scan and their residuals at the pose. `residual_ut`: of each reading, magnetometer axes.
  /// Readings of weight zero are ignored.
  void add(const Pose& T_map_imu, std::span<const FieldReading> readings, std::span<const Vector3> residual_ut);

  /// Variance per component, independent in each reading, that limits the information of a metre's readings as much as
  /// the shared error does, µT². 0: nothing is known yet.
  double variance_a_reading_ut2() const;

 private:
  Vector3 begin_ = Vector3::Zero();
  Vector3 sum_ut_ = Vector3::Zero();
  double noise_sum_ut2_ = 0.0;
  int readings_ = 0;
  std::deque<double> variances_ut2_;  // of the last metres
  double readings_a_metre_ = 0.0;     // of the last metre
};

}  // namespace lodestone

#pragma once

#include <deque>
#include <span>

#include "core/geometry/pose.h"
#include "factors/field_factor.h"

namespace lodestone {

/// What all magnetometers of an array read beside the map, over a metre of the way: a map that was surveyed at wrong
/// places, motors, steel that moved. It does not average out within the metre, however many readings there are. Its
/// variance is taken from the log: means of the array's residuals over a metre, less what noise of the sensors makes of
/// them. The median of the last metres: metres in which the pose was wrong must not excuse themselves.
class FieldError {
 public:
  /// The readings of a scan and their residuals at the pose. `residual_ut`: of each reading, magnetometer axes;
  /// `sensor_variance_ut2`: of each reading's component by the sensor's noise alone. A reading of weight zero does not
  /// count.
  void add(const Pose& T_map_imu, std::span<const FieldReading> readings, std::span<const Vector3> residual_ut,
           std::span<const double> sensor_variance_ut2);

  /// Variance of a reading's component that, independent in each reading, holds as much back as the error of a metre,
  /// µT². 0: nothing is known yet.
  double variance_a_reading_ut2() const;

 private:
  Vector3 begin_ = Vector3::Zero();
  Vector3 sum_ut_ = Vector3::Zero();
  double noise_sum_ut2_ = 0.0;
  int readings_ = 0;
  std::deque<double> variances_ut2_;  // of the last metres
  double readings_a_metre_ = 0.0;     // of the last one
};

}  // namespace lodestone

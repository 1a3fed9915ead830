#pragma once

#include <span>
#include <vector>

#include "core/geometry/so3.h"
#include "estimators/calibration/calibration_log.h"
#include "factors/calibrated_reading_factor.h"

namespace lodestone {

/// Model of the change of the field around the robot (without a map), or of the map's error (with a map), along the
/// log.
struct FieldProcess {
  double step_ut_sqrt_s = 1.0;          ///< without a map: random walk of the array's field
  double slope_ut_m = 10.0;             ///< without a map: size of the field's gradient, per component
  double slope_step_ut_m_sqrt_s = 5.0;  ///< without a map: random walk of the gradient
  double map_scale = 1.0;               ///< with a map: the map's error relative to its stated sigma
  std::vector<double> place_scale;      ///< with a map: further factor of each place; 1 unless the place deviates
  double map_change_ut = 0.0;           ///< with a map: prior sigma of its change everywhere; 0: no change is modelled
};

/// The array's field and its gradient at each moment, in imu axes.
struct FieldStates {
  std::vector<Vector3> field_ut;
  std::vector<FieldSlope> slope_ut_m;
};

/// A step of a state x from one moment to the next: r = after · x' − before · (x rotated).
struct StepWeights {
  double after = 1.0;
  double before = 1.0;
};

StepWeights field_step(const CalibrationLog& log, std::size_t moment, const FieldProcess& process,
                       const CalibrationOptions& options);
StepWeights slope_step(const CalibrationLog& log, std::size_t moment, const FieldProcess& process,
                       const CalibrationOptions& options);

/// Sigma of a state at the begin of a stretch of the log.
double field_start_sigma(const CalibrationMoment& moment, bool mapped, const FieldProcess& process);
double slope_start_sigma(const CalibrationMoment& moment, bool mapped, const FieldProcess& process,
                         const CalibrationOptions& options);

/// Sigma of the map's error at a moment, per component.
double map_sigma(const CalibrationMoment& moment, const FieldProcess& process);

/// The process estimated from the states of a log without a map. A random walk is a coarse model of the field along a
/// drive, whose change first grows with time and then levels off. It gets the largest variance per second over lags of
/// 0.5 to 8 s, so that the model is conservative. `common`: the distortion that all magnetometers share, imu axes; the
/// array's reading without it rotates with the robot.
FieldProcess observed_process(const CalibrationLog& log, const FieldStates& states, const Vector3& gyroscope_bias,
                              const Matrix3& common);

/// The same for the map's error: `process` with its scales. If all magnetometers deviate from the map by more than
/// twice the usual error, the place's sigma grows with the square of the excess: changed places then have little weight
/// in the calibration (a redescending weight) and do not affect map_scale.
FieldProcess observed_map_error(const CalibrationLog& log, const FieldStates& states, const FieldProcess& process,
                                const CalibrationOptions& options);

}  // namespace lodestone

#pragma once

#include <span>
#include <vector>

#include "core/geometry/so3.h"
#include "estimators/calibration/calibration_log.h"
#include "factors/calibrated_reading_factor.h"

namespace lodestone {

/// How the field about the robot (without a map), or the map's error (with one), changes along the log.
struct FieldProcess {
  double step_ut_sqrt_s = 1.0;          ///< without a map: random walk of the field that the array reads
  double slope_ut_m = 10.0;             ///< without a map: size of the field's slope, a component
  double slope_step_ut_m_sqrt_s = 5.0;  ///< without a map: how fast it changes
  double map_scale = 1.0;               ///< with a map: the map's error over what its sigma says
  std::vector<double> place_scale;      ///< with a map: the same of each place beyond map_scale; 1 unless it stands out
  double map_change_ut = 0.0;           ///< with a map: prior sigma of its change everywhere; 0: none is modelled
};

/// The array's field and its slope at each moment, in imu axes.
struct FieldStates {
  std::vector<Vector3> field_ut;
  std::vector<FieldSlope> slope_ut_m;
};

/// A step of a state x from one moment to the next: r = after · x' − before · (x turned).
struct StepWeights {
  double after = 1.0;
  double before = 1.0;
};

StepWeights field_step(const CalibrationLog& log, std::size_t moment, const FieldProcess& process,
                       const CalibrationOptions& options);
StepWeights slope_step(const CalibrationLog& log, std::size_t moment, const FieldProcess& process,
                       const CalibrationOptions& options);

/// Sigma of a state where a stretch of the log begins.
double field_start_sigma(const CalibrationMoment& moment, bool mapped, const FieldProcess& process);
double slope_start_sigma(const CalibrationMoment& moment, bool mapped, const FieldProcess& process,
                         const CalibrationOptions& options);

/// Sigma of the map's error at a moment, a component.
double map_sigma(const CalibrationMoment& moment, const FieldProcess& process);

/// The process that states of a log without a map show. A random walk is a coarse model of a field that a robot drives
/// through, whose change grows with the time at first and then levels off: it gets the largest of the variances per
/// second over lags of 0.5 to 8 s, so that it promises too little rather than too much. `common`: the distortion that
/// all magnetometers share, imu axes: what the array reads, less that, is what turns.
FieldProcess observed_process(const CalibrationLog& log, const FieldStates& states, const Vector3& gyroscope_bias,
                              const Matrix3& common);

/// The same for the map's error: `process` with its scales. Where all magnetometers differ from the map by more than
/// twice what they do at most places, the place's sigma grows with the square of the excess: changed places then hardly
/// count in the calibration (a redescending weight), and not in map_scale.
FieldProcess observed_map_error(const CalibrationLog& log, const FieldStates& states, const FieldProcess& process,
                                const CalibrationOptions& options);

}  // namespace lodestone

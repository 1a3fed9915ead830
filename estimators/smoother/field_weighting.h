#pragma once

#include <functional>
#include <span>
#include <vector>

#include "core/magnetometer/array_reading.h"
#include "core/magnetometer/field_residual.h"
#include "core/magnetometer/magnetic_map.h"
#include "core/sensor_suite.h"
#include "estimators/options.h"
#include "factors/sliding_window.h"

namespace lodestone {

/// What weighing a scan's array readings found; goes into the diagnostics.
struct FieldStatistics {
  int arrays = 0;     ///< array readings that met the map
  int rejected = 0;   ///< of these, with a Huber weight below one half
  int off_map = 0;    ///< single readings without field
  int set_aside = 0;  ///< single readings that the rest of their array contradicts
  double weight_sum = 0.0;
  double innovation_sum = 0.0;        ///< Σ rᵀ S⁻¹ r, of those not set aside
  int innovations = 0;                ///< components in it
  double residual_squared_sum = 0.0;  ///< µT², over components
  int components = 0;
};

struct FieldWeighting {
  const SensorSuite& suite;
  const MagneticMap& map;
  const MagneticOptions& options;
  const std::vector<double>& crowding;  ///< of each magnetometer, by array_crowding
  double sensor_gate;                   ///< Mahalanobis distance of a magnetometer from what its fellows say
  std::function<Vector3(int)> bias_ut;  ///< of each magnetometer
  std::function<Matrix3(int)> matrix;   ///< E of each magnetometer: bias + (1 + E) field is read
  SlidingWindow::ClockOffset clock;     ///< of all
  double error_variance_ut2 = 0.0;      ///< of the field's error, a reading (FieldError)
};

/// The residual of a reading whose magnetometer reads bias + (1 + E) field; the derivative is that of an exact one.
/// `T_end_mag`: of the reading at its time; `map`: the field there.
FieldResidual calibrated_residual(const Pose& T_map_imu, const Pose& T_end_mag, const Vector3& measured_ut,
                                  const Vector3& bias_ut, const Matrix3& matrix, const FieldValue& map);

/// The distance over which the map's error is alike: the option, else as the map states, else 0.1 m.
double map_correlation_m(const MagneticOptions& options, const MagneticMap& map);

/// How many magnetometers of the array share each one's map error, itself included: Σ exp(−distance/correlation_m).
std::vector<double> array_crowding(const SensorSuite& suite, double correlation_m);

/// Readings of one scan with the noise that each deserves and Huber's weight of its array (one weight an array sample,
/// on the Mahalanobis distance s = √(rᵀ S⁻¹ r), S = J P Jᵀ + R), once magnetometers that their fellows contradict are
/// set aside. `T_map_imu`: predicted pose at t_k, `covariance`: its P (φ, p). `spacing_m`: distance between
/// neighbouring array readings; their map errors are correlated over options.map_correlation_m along the way and across
/// the array, which inflates the map's share. `factor`: multiplies every weight (β²).
std::vector<FieldReading> weigh_field(std::span<const ArrayReading> arrays, const Pose& T_map_imu,
                                      const Matrix6& covariance, double spacing_m, double factor,
                                      const FieldWeighting& weighting, FieldStatistics& statistics);

}  // namespace lodestone

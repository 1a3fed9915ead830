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

/// Statistics of one scan's field readings, for the diagnostics.
struct FieldStatistics {
  int arrays = 0;     ///< array readings on the map
  int rejected = 0;   ///< array readings with a Huber weight below one half
  int off_map = 0;    ///< single readings off the map
  int set_aside = 0;  ///< single readings that are rejected because they contradict the rest of their array
  double weight_sum = 0.0;
  double innovation_sum = 0.0;        ///< Σ rᵀ S⁻¹ r over readings that are not rejected
  int innovations = 0;                ///< number of components in that sum
  double residual_squared_sum = 0.0;  ///< µT², over components
  int components = 0;
};

struct FieldWeighting {
  const SensorSuite& suite;
  const MagneticMap& map;
  const MagneticOptions& options;
  const std::vector<double>& crowding;  ///< of each magnetometer, from array_crowding
  double sensor_gate;  ///< gate on the Mahalanobis distance of a magnetometer from its prediction by the others
  std::function<Vector3(int)> bias_ut;  ///< of each magnetometer
  std::function<Matrix3(int)> matrix;   ///< E of each magnetometer: the reading is bias + (1 + E) field
  SlidingWindow::ClockOffset clock;     ///< of all magnetometers
  double error_variance_ut2 = 0.0;      ///< of the shared field error, per reading (FieldError)
};

/// The residual of a magnetometer that reads bias + (1 + E) field; the derivative is for E = 0. `T_end_mag`: pose of
/// the magnetometer at the reading's time; `map`: the field there.
FieldResidual calibrated_residual(const Pose& T_map_imu, const Pose& T_end_mag, const Vector3& measured_ut,
                                  const Vector3& bias_ut, const Matrix3& matrix, const FieldValue& map);

/// The correlation length of the map's error: the option, else the value of the map, else 0.1 m.
double map_correlation_m(const MagneticOptions& options, const MagneticMap& map);

/// The number of magnetometers that share each one's map error, itself included: Σ exp(−distance/correlation_m).
std::vector<double> array_crowding(const SensorSuite& suite, double correlation_m);

/// Weights the readings of one scan: rejects magnetometers that contradict the others of their array, then computes
/// each reading's noise and one Huber weight per array sample from s = √(rᵀ S⁻¹ r), S = J P Jᵀ + R. `T_map_imu`:
/// predicted pose at t_k, `covariance`: its P (φ, p). `spacing_m`: distance between consecutive array readings; their
/// map errors are correlated over options.map_correlation_m along the path and across the array, which inflates the
/// map's variance. `factor`: scales every weight (β²).
std::vector<FieldReading> weigh_field(std::span<const ArrayReading> arrays, const Pose& T_map_imu,
                                      const Matrix6& covariance, double spacing_m, double factor,
                                      const FieldWeighting& weighting, FieldStatistics& statistics);

}  // namespace lodestone

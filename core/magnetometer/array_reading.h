#pragma once

#include <optional>
#include <span>
#include <vector>

#include "core/imu/scan_motion.h"
#include "core/measurements.h"
#include "core/sensor_suite.h"

namespace lodestone {

/// The mean of a few neighbouring samples of one magnetometer, placed relative to the scan's end.
struct MeanReading {
  Pose T_end_mag;  ///< transforms points in the magnetometer's frame at the mean time to the imu frame at t_k
  Vector3 measured_ut = Vector3::Zero();
  int magnetometer = 0;
  int samples = 0;
  Vector3 velocity_m_s = Vector3::Zero();  ///< of the magnetometer at the mean time, imu frame at t_k
  Vector3 turn_rad_s = Vector3::Zero();    ///< its rate of rotation, in its own axes
};

/// Readings of the whole array around one time.
struct ArrayReading {
  Time time = 0;
  std::vector<MeanReading> readings;  ///< in the order of the suite; magnetometers without samples are omitted
};

/// Averages every `samples_per_reading` consecutive array samples. This reduces white noise, and the map's error is not
/// averaged as if it were independent over a centimetre. Fewer remaining samples form a last reading.
std::vector<ArrayReading> average_array(std::span<const MagneticArraySample> samples, const ScanMotion& motion,
                                        const SensorSuite& suite, int samples_per_reading);

/// Variance of a component of a reading by its own magnetometer, µT²: noise, and what the calibration leaves (offset;
/// rotation and matrix, relative to the field). Independent of the other magnetometers.
double sensor_variance_ut2(const MeanReading& reading, const SensorSuite& suite);

/// Inflation of the variance of a map's error if samples `spacing_m` apart share it over `correlation_m`: (1 + ρ)/(1 −
/// ρ), ρ = exp(−spacing/correlation), for a first-order Gauss-Markov error; at most 40, also at a standstill
/// (docs/design/013-correlated-field-map-error.md).
double correlation_inflation(double spacing_m, double correlation_m);

/// The magnetometers' readings at the end of a bundle's scan: the mean over the last 0.05 s. `end`: state there. None
/// if the bundle has no readings.
std::optional<ArrayReading> reading_at_end(const ScanBundle& bundle, const NavState& end, const SensorSuite& suite);

/// The median of each component: of an even number of vectors, the mean of the middle two. Requires at least one.
Vector3 middle_of(std::span<const Vector3> vectors);

}  // namespace lodestone

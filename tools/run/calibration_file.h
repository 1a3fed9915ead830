#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/sensor_suite.h"
#include "core/warnings.h"
#include "factors/calibration_estimate.h"

namespace lodestone {

/// One parameter of a calibration, as a difference from the platform file.
struct CalibrationRow {
  std::string sensor;  ///< lidar, wheels, magnetometers (all), or the name of a magnetometer
  std::string parameter;
  std::string part;             ///< of the sensor's calibration: rotation, translation, clock or matrix
  std::string unit;             ///< of the three values
  double estimate = 0.0;        ///< difference from the platform file
  double sigma = 0.0;           ///< remaining sigma; 0: not estimated
  double platform_sigma = 0.0;  ///< of the platform file; 0: exact
  std::string key, sigma_key;   ///< of the platform file

  bool is_estimated() const { return sigma > 0.0 && platform_sigma > 0.0; }
};

/// All parameters, estimated or not. The order depends only on the sensors of the suite.
std::vector<CalibrationRow> calibration_rows(const SensorSuite& suite, const CalibrationEstimate& estimate);

/// Writes the estimated calibration: one row per estimated parameter with its difference from the platform file, the
/// platform file's sigma and the remaining sigma. Throws InputError if the file cannot be written.
void write_calibration(const std::filesystem::path& path, const SensorSuite& suite,
                       const CalibrationEstimate& estimate);

/// Warns of parameters beyond three sigmas of the platform file, as calibration.lidar.PART, calibration.wheels.PART and
/// calibration.magnetometers.PART. The text names the farthest parameter, its key, and what to change.
void warn_of_calibration(const SensorSuite& suite, const CalibrationEstimate& estimate, Time time,
                         WarningLog& warnings);

}  // namespace lodestone

#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/sensor_suite.h"
#include "core/warnings.h"
#include "factors/calibration_estimate.h"

namespace lodestone {

/// One parameter of a calibration, a departure from the platform file.
struct CalibrationRow {
  std::string sensor;  ///< lidar, magnetometers (all of them), or the name of one
  std::string parameter;
  std::string part;             ///< of the sensor's calibration: rotation, translation, clock or matrix
  std::string unit;             ///< of the three values
  double estimate = 0.0;        ///< departure from the platform file
  double sigma = 0.0;           ///< what is left; 0: not estimated
  double platform_sigma = 0.0;  ///< of the platform file; 0: exact
  std::string key, sigma_key;   ///< of the platform file

  bool is_estimated() const { return sigma > 0.0 && platform_sigma > 0.0; }
};

/// Every parameter, estimated or not, in the same order for any estimate of as many magnetometers.
std::vector<CalibrationRow> calibration_rows(const SensorSuite& suite, const CalibrationEstimate& estimate);

/// Writes what a log said of the calibration: a row for each parameter with its estimate, a departure from the platform
/// file, and two sigmas, the platform file's and what is left of it. Parameters that are not estimated have no row.
/// Throws InputError where the file cannot be written.
void write_calibration(const std::filesystem::path& path, const SensorSuite& suite,
                       const CalibrationEstimate& estimate);

/// Counts the parameters beyond three sigmas of the platform file as calibration.lidar.PART and
/// calibration.magnetometers.PART. The text names the farthest of them, its key, and what to change.
void warn_of_calibration(const SensorSuite& suite, const CalibrationEstimate& estimate, Time time,
                         WarningLog& warnings);

}  // namespace lodestone

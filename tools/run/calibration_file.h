#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/sensor_suite.h"
#include "factors/calibration_estimate.h"

namespace lodestone {

/// One parameter of a calibration, a departure from the platform file.
struct CalibrationRow {
  std::string sensor;
  std::string parameter;
  const char* unit;
  double estimate;        ///< in `unit`, as both sigmas
  double sigma;           ///< of the estimate; 0: not estimated
  double platform_sigma;  ///< of the platform file; 0: exact

  bool is_estimated() const { return sigma > 0.0 && platform_sigma > 0.0; }
};

/// Every parameter, estimated or not, in the same order for any estimate of as many magnetometers.
std::vector<CalibrationRow> calibration_rows(const SensorSuite& suite, const CalibrationEstimate& estimate);

/// Writes what a log said of the calibration: a row for each parameter with its estimate, a departure from the platform
/// file, and two sigmas, the platform file's and what is left of it. Parameters that are not estimated have no row.
/// Throws InputError where the file cannot be written.
void write_calibration(const std::filesystem::path& path, const SensorSuite& suite,
                       const CalibrationEstimate& estimate);

}  // namespace lodestone

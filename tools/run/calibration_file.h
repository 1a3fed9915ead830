#pragma once

#include <filesystem>

#include "core/sensor_suite.h"
#include "factors/calibration_estimate.h"

namespace lodestone {

/// Writes what a log said of the calibration: a row for each parameter with its estimate, a departure from the platform
/// file, and two sigmas, the platform file's and what is left of it. Parameters that are not estimated have no row.
/// Throws InputError where the file cannot be written.
void write_calibration(const std::filesystem::path& path, const SensorSuite& suite,
                       const CalibrationEstimate& estimate);

}  // namespace lodestone

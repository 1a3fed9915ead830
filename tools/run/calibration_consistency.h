#pragma once

#include <optional>
#include <string>

#include "core/sensor_suite.h"
#include "factors/calibration_estimate.h"

namespace lodestone {

/// Errors of an estimated calibration relative to its sigmas.
struct CalibrationConsistency {
  int parameters = 0;                ///< number of estimated parameters
  double nees = 0.0;                 ///< mean of (error / sigma)²; 1 is consistent, above 1 overconfident
  std::optional<double> nees_lidar;  ///< the same for the LiDAR's parameters; nothing if not estimated
  double prior_nees = 0.0;           ///< the same for the platform file: its error over its sigma
};

/// Reads the true calibration from reality.yaml of `lodestone simulate`: differences from the calibration in `suite`,
/// as CalibrationEstimate defines them, with zero sigmas. Throws InputError if the file is broken or lacks a
/// magnetometer of `suite`.
CalibrationEstimate read_true_calibration(const std::string& path, const SensorSuite& suite);

/// Compares every estimated parameter. Nothing if there is none.
std::optional<CalibrationConsistency> compare_calibration(const SensorSuite& suite, const CalibrationEstimate& estimate,
                                                          const CalibrationEstimate& truth);

}  // namespace lodestone

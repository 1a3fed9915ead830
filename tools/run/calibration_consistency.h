#pragma once

#include <optional>
#include <string>

#include "core/sensor_suite.h"
#include "factors/calibration_estimate.h"

namespace lodestone {

/// How large the errors of an estimated calibration are beside its sigmas.
struct CalibrationConsistency {
  int parameters = 0;                ///< that were estimated
  double nees = 0.0;                 ///< mean of (error / sigma)²; 1 is consistent, above 1 overconfident
  std::optional<double> nees_lidar;  ///< the same of the LiDAR alone: few of many; nothing if it was not estimated
  double prior_nees = 0.0;           ///< the same of the platform file: its error over its own sigma
};

/// Reads the true calibration from reality.yaml as `lodestone simulate` writes it: departures from the calibration in
/// `suite`, each as CalibrationEstimate defines it, with sigmas zero. Throws InputError where the file is broken or has
/// no magnetometer of a name in `suite`.
CalibrationEstimate read_true_calibration(const std::string& path, const SensorSuite& suite);

/// Compares every parameter that was estimated; nothing where there is none.
std::optional<CalibrationConsistency> compare_calibration(const SensorSuite& suite, const CalibrationEstimate& estimate,
                                                          const CalibrationEstimate& truth);

}  // namespace lodestone

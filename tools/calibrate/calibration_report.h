#pragma once

#include <string>

#include "estimators/calibration/magnetometer_calibrator.h"
#include "frontends/configuration/platform.h"
#include "tools/calibrate/shown_changes.h"

namespace lodestone {

/// Input files of a calibration, for its report.
struct CalibrationSources {
  std::string log, platform, magnetic, trajectory;  ///< as given; the last two empty without a map
};

/// The platform with the changes applied: the calibration that readers of the log subtract.
Platform calibrated_platform(const Platform& given, const ShownChanges& changes);

/// For the terminal: residuals before and after, parameters with sigmas, and the held parameters.
std::string calibration_text(const Platform& platform, const MagnetometerCalibrationResult& result,
                             const ShownChanges& changes, bool mapped);

/// The same with all digits, as JSON. `platform`: the calibrated one.
std::string calibration_json(const CalibrationSources& sources, const Platform& platform,
                             const MagnetometerCalibrationResult& result, const ShownChanges& changes,
                             const CalibrationOptions& options);

}  // namespace lodestone

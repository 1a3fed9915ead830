#pragma once

#include <array>
#include <string>
#include <vector>

#include "estimators/calibration/magnetometer_calibrator.h"

namespace lodestone {

/// Of a calibration, what the log shows: the changes that go into the platform file.
struct ShownChanges {
  std::vector<MagnetometerCalibration> calibrations;  ///< in the order of the suite
  std::vector<std::array<bool, 12>> taken;  ///< of each: hard iron x y z, then the nine numbers of the distortion
};

/// A change below two of its sigmas is none: it is set to zero, and the others to what they are given that (mean and
/// covariance conditioned on it), the least first, until every change that is left exceeds two sigmas. So a sum that is
/// well known is kept whole by one of its parts where no part is known by itself.
ShownChanges shown_changes(const MagnetometerCalibrationResult& result);

/// "front_0: hard iron x, scale z; front_1: everything": what is left as given; empty where nothing is.
std::string left_as_given(const ShownChanges& changes, const std::vector<MagnetometerModel>& magnetometers,
                          const MagnetometerCalibrationResult& result);

}  // namespace lodestone

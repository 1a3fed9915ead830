#pragma once

#include <array>
#include <string>
#include <vector>

#include "estimators/calibration/magnetometer_calibrator.h"

namespace lodestone {

/// The changes of one magnetometer's parameters when they were compared with two sigmas.
struct TestedChanges {
  CalibrationParameters change = CalibrationParameters::Zero();  ///< the written one if the parameter is changed
  CalibrationParameters sigma = CalibrationParameters::Zero();   ///< given the parameters that were set to zero before
};

/// The significant changes of a calibration, which are written to the platform file.
struct ShownChanges {
  std::vector<MagnetometerCalibration> calibrations;  ///< in the order of the suite
  std::vector<std::array<bool, 12>> taken;            ///< of each: hard iron x y z, then the distortion (nine numbers)
  std::vector<TestedChanges> tested;
};

/// Drops changes below two sigmas, smallest ratio first: each is set to zero, and mean and covariance of the others are
/// conditioned on it, until all remaining changes exceed two sigmas. If only a sum of parameters is known, one of them
/// keeps the whole sum.
ShownChanges shown_changes(const MagnetometerCalibrationResult& result);

/// "front_0: hard iron x, scale z; front_1: everything": the unchanged parameters; empty if there are none.
std::string left_as_given(const ShownChanges& changes, const std::vector<MagnetometerModel>& magnetometers,
                          const MagnetometerCalibrationResult& result);

}  // namespace lodestone

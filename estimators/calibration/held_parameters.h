#pragma once

#include <string>
#include <vector>

#include "core/observability/parameter_gain.h"
#include "estimators/calibration/calibration_problem.h"

namespace lodestone {

/// What was held at its prior, in words, for instance "front_0: offset along z of the sensor: not shown by this motion;
/// held at 0 ± 20 µT". One line a kind of parameter, with the magnetometers of which it is true; and what is hidden
/// only in so far as all magnetometers have it alike: "all magnetometers alike: scale: …". `active`: the magnetometers
/// that `gain` is of, 12 parameters each; magnetometers without readings get a line of their own.
std::vector<std::string> describe_held(const ParameterGain& gain, const std::vector<MagnetometerModel>& magnetometers,
                                       const std::vector<int>& active, const CalibrationOptions& options,
                                       bool map_changed = false);

}  // namespace lodestone

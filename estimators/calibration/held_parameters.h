#pragma once

#include <string>
#include <vector>

#include "core/observability/parameter_gain.h"
#include "estimators/calibration/calibration_problem.h"

namespace lodestone {

/// Text about the parameters that are kept at their prior, for instance "front_0: offset along z of the sensor: not
/// determined by this motion; kept as given ± 20 µT". One line per kind of parameter, with the names of its
/// magnetometers; parameters of which only the common value is undetermined: "all magnetometers alike: scale: …".
/// `active`: the magnetometers of `gain`, 12 parameters each; magnetometers without readings get a line of their own.
std::vector<std::string> describe_held(const ParameterGain& gain, const std::vector<MagnetometerModel>& magnetometers,
                                       const std::vector<int>& active, const CalibrationOptions& options,
                                       bool map_changed = false);

}  // namespace lodestone

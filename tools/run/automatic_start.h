#pragma once

#include <functional>
#include <string>

#include "estimators/initialization/start_finder.h"

namespace lodestone {

/// A start that was found by itself, for all estimators of a call.
struct AutomaticStart {
  Pose T_map_imu;                      ///< at the first scan's start
  Vector3 velocity = Vector3::Zero();  ///< map axes, m/s
};

/// `--initial-pose auto`: finds where a log begins from its first input.options.search.data_s. `next`: its bundles from
/// the first on. Prints what was found. Throws InputError, with the best candidates ready for --initial-pose, where it
/// is not sure: a run from a wrong place costs more than asking. `log` is named in messages.
AutomaticStart find_automatic_start(const std::string& log, const EstimatorInput& input,
                                    const std::function<bool(ScanBundle&)>& next, WarningLog& warnings);

}  // namespace lodestone

#pragma once

#include <functional>
#include <string>

#include "estimators/initialization/start_finder.h"

namespace lodestone {

/// The initial pose that a search found.
struct FoundInitialPose {
  StartHypothesis start;
  std::string description;  ///< the pose, its probability and the time of the search, as one line
};

/// `--initial-pose auto`: finds the initial pose from the first input.options.search.data_s of a log. `next`: its
/// bundles from the first on. Throws InputError with the best candidates if the result is not certain, because a run
/// from a wrong place costs more than an error. `log` is named in messages; `origin_m` is added to poses there.
FoundInitialPose find_initial_pose(const std::string& log, const EstimatorInput& input,
                                   const std::function<bool(ScanBundle&)>& next, WarningLog& warnings,
                                   const Vector3& origin_m = Vector3::Zero());

}  // namespace lodestone

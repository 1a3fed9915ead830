#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "core/geometry/so3.h"
#include "core/geometry/trajectory.h"
#include "tools/report/estimator_data.h"

namespace lodestone {

/// The results of one estimator.
struct EstimatorResults {
  EstimatorFiles files;
  std::map<Time, Matrix6> covariances;  ///< tangent order φ, p; some poses may have none
};

/// The results in a folder of `lodestone run`.
struct RunResults {
  std::filesystem::path folder;
  std::string platform;                      ///< the platform file of the run, as given; empty if unknown
  Vector3 origin_m = Vector3::Zero();        ///< of the site, in the coordinates of the maps' files
  std::string cloud;                         ///< the cloud map of the run, as given; empty if none
  std::vector<EstimatorResults> estimators;  ///< in the order of the run, or of the choice
  Trajectory truth;                          ///< at scan ends; empty if not given
  Time begin = 0;                            ///< of the first scan
};

/// Reads the results of the chosen estimators; of all if `chosen` is empty. Throws InputError if the folder is missing,
/// is not of a run, or is of an unfinished run; if a name is unknown; or if a file is malformed.
RunResults read_run_results(const std::filesystem::path& folder, const std::vector<std::string>& chosen);

}  // namespace lodestone

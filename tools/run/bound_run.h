#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "tools/run/estimator_run.h"

namespace lodestone {

/// The smallest rmse that the sensors and maps of a log allow (Cramér-Rao), for each kind of estimate.
struct Bound {
  struct Stage {
    std::string name;          ///< causal, smoothed, batch
    double position_m = 0.0;   ///< √ of the mean of the position covariance's trace
    double heading_deg = 0.0;  ///< √ of the mean variance of a rotation about the map's z
  };
  std::vector<Stage> stages;

  /// Nothing if there is no such stage.
  const Stage* find(const std::string& name) const;
};

/// Runs an estimator of bound_input over the log. Writes `file`: one row per scan, the predicted sigmas of each stage.
/// Throws InputError if the log has no scan or the file cannot be written.
Bound run_bound(const std::function<OpenedLog()>& open,
                const std::function<std::unique_ptr<Estimator>(const ScanBundle&)>& make_estimator,
                const Trajectory& truth, const std::filesystem::path& file);

}  // namespace lodestone

#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "tools/run/estimator_run.h"

namespace lodestone {

/// The least rmse that the sensors and maps of a log allow, by what of the log an estimate knows.
struct Bound {
  struct Stage {
    std::string name;          ///< causal, smoothed, batch
    double position_m = 0.0;   ///< √ of the mean of the position covariance's trace
    double heading_deg = 0.0;  ///< √ of the mean variance of a turn about the map's z
  };
  std::vector<Stage> stages;

  /// Nothing where it has no such stage.
  const Stage* find(const std::string& name) const;
};

/// A pass over the log with an estimator made of bound_input. Writes `file`: one row a scan, the predicted sigmas of
/// each stage. Throws InputError where the log holds no scan or the file cannot be written.
Bound run_bound(const std::function<OpenedLog()>& open,
                const std::function<std::unique_ptr<Estimator>(const ScanBundle&)>& make_estimator,
                const Trajectory& truth, const std::filesystem::path& file);

}  // namespace lodestone

#pragma once

#include <filesystem>
#include <string>

#include "estimators/estimator.h"
#include "tools/sinks/output_file.h"

namespace lodestone {

/// Writes trajectory.tum (best), causal.tum, covariance.csv (of the best) and diagnostics.csv (one row a scan, as the
/// causal step saw it) into a folder. The files appear with `finish`.
class EstimateFiles : public EstimateSink {
 public:
  /// Makes the folder. Throws InputError where that cannot be.
  explicit EstimateFiles(const std::filesystem::path& folder);

  void causal(const Estimate& estimate) override;
  void best(const Estimate& estimate) override;

  /// Puts the files in place. `mark` (one line; empty for a whole run) is added to both trajectories as a comment.
  void finish(const std::string& mark);

 private:
  OutputFile trajectory_;
  OutputFile causal_;
  OutputFile covariance_;
  OutputFile diagnostics_;
};

/// The health's name as written: good, degenerate, lost.
const char* health_name(Health health);

}  // namespace lodestone

#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "estimators/estimator.h"
#include "tools/writers/output_file.h"

namespace lodestone {

/// Writes trajectory.tum (best), causal.tum, smoothed.tum (where a batch refines it), covariance.csv (of the best) and
/// diagnostics.csv (one row a scan, as the causal step saw it) into a folder. The files appear with `finish`.
class EstimateFiles : public EstimateSink {
 public:
  /// Makes the folder. Throws InputError where that cannot be.
  explicit EstimateFiles(const std::filesystem::path& folder);

  void causal(const Estimate& estimate) override;
  void best(const Estimate& estimate) override;
  void smoothed(const Estimate& estimate) override;

  /// Puts the files in place. `mark` (one line; empty for a whole run) is added to both trajectories as a comment.
  void finish(const std::string& mark);

 private:
  std::filesystem::path folder_;
  OutputFile trajectory_;
  OutputFile causal_;
  std::unique_ptr<OutputFile> smoothed_;  // made when there is something to write
  OutputFile covariance_;
  OutputFile diagnostics_;
};

/// The health's name as written: good, degenerate, lost.
const char* health_name(Health health);

}  // namespace lodestone

#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "core/options.h"
#include "estimators/estimator.h"
#include "frontends/configuration/output_file.h"
#include "tools/writers/lost_intervals.h"

namespace lodestone {

/// The comment that begins a trajectory file.
inline constexpr const char* kTrajectoryColumns = "t_s x_m y_m z_m qx qy qz qw: T_map_imu at scan ends";

/// Writes trajectory.tum (best, without the poses of scans at which the estimator was lost), causal.tum, smoothed.tum
/// (if a batch refines the trajectory), covariance.csv (of best) and diagnostics.csv (one row per scan, from the causal
/// step) into a folder. The files appear with `finish`.
class EstimateFiles : public EstimateSink {
 public:
  /// Creates the folder. Throws InputError if this fails.
  explicit EstimateFiles(const std::filesystem::path& folder);

  void causal(const Estimate& estimate) override;
  void best(const Estimate& estimate) override;
  void smoothed(const Estimate& estimate) override;

  /// Renames the files to their final names. `mark` (one line; empty for a complete run) is added to both trajectories
  /// as a comment.
  void finish(const std::string& mark);

 private:
  std::filesystem::path folder_;
  OutputFile trajectory_;
  OutputFile causal_;
  std::unique_ptr<OutputFile> smoothed_;  // created with the first smoothed pose
  OutputFile covariance_;
  OutputFile diagnostics_;
  LostIntervals lost_;
};

/// The names in diagnostics.csv.
constexpr auto enum_names(Health) {
  return EnumNames<Health, 3>{{{Health::good, "good"}, {Health::uncertain, "uncertain"}, {Health::lost, "lost"}}};
}

constexpr auto enum_names(HealthReason) {
  return EnumNames<HealthReason, 8>{{{HealthReason::none, "none"},
                                     {HealthReason::not_finite, "not_finite"},
                                     {HealthReason::covariance, "covariance"},
                                     {HealthReason::unobserved, "unobserved"},
                                     {HealthReason::scan_off_map, "scan_off_map"},
                                     {HealthReason::field_off_map, "field_off_map"},
                                     {HealthReason::motion, "motion"},
                                     {HealthReason::searching, "searching"}}};
}

}  // namespace lodestone

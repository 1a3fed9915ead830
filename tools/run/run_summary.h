#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/evaluation/association.h"
#include "core/evaluation/consistency.h"
#include "core/evaluation/stale_map.h"
#include "core/warnings.h"
#include "tools/run/calibration_consistency.h"
#include "tools/run/estimate_record.h"
#include "tools/run/run_call.h"

namespace lodestone {

struct Bound;

/// How a run ended.
enum class RunStatus {
  done,
  lost,         ///< the estimator's last word was that it lost track
  interrupted,  ///< by a signal
  stopped       ///< the log became unusable on the way
};

const char* status_name(RunStatus status);

/// A run held against the truth (interpolated at the estimate's stamps). Of the best estimate.
struct TruthFigures {
  PosePairs pairs;
  double ate_m = 0.0;               ///< unaligned rmse
  std::optional<double> ate_se3_m;  ///< nothing where the path fixes no alignment
  double max_error_m = 0.0;
  double heading_rmse_deg = 0.0;
  std::optional<double> nees_pose;  ///< per degree of freedom; nothing without usable covariances
  bool success = false;             ///< never more than 1 m off, and at the end of the log
};

/// One kind of estimate of a run held against the truth.
struct StageFigures {
  std::string name;  ///< causal: the newest states; smoothed: those that leave the window; batch: of the whole log
  double ate_m = 0.0;
  double max_error_m = 0.0;
  std::optional<double> largest_jump_m;  ///< between neighbouring poses, against the truth's step; nothing for one pose
  double heading_rmse_deg = 0.0;
  std::optional<Consistency> consistency;  ///< nothing without usable covariances
  std::optional<double> ate_over_bound;    ///< nothing where no bound was asked for
  double share_within_100mm = 0.0;         ///< of the time from the first pose to the end of the log
  double share_within_1m = 0.0;            ///< likewise
};

struct RunSummary {
  std::string estimator;
  std::string solver;  ///< library and linear solver; empty if the estimator minimizes no cost
  RunStatus status = RunStatus::done;
  std::int64_t scans = 0;
  double duration_s = 0.0;  ///< of the log, as far as it was worked off
  double wall_s = 0.0;      ///< reading, estimating and writing
  double peak_rss_mb = 0.0;
  std::int64_t degenerate_scans = 0;
  bool saw_lidar =
      false;  ///< in at least one scan directions were analysed; else there are no degenerate ones to count
  bool saw_field = false;  ///< in at least one scan a sample of the array met the map
  std::int64_t magnetic_rejected = 0;
  double refine_s = 0.0;               ///< of it what came after the log's end: the batch refinement
  std::optional<double> lidar_nis;     ///< mean over the scans, a point; 1 is consistent
  std::optional<double> magnetic_nis;  ///< mean over the scans' array samples, per component; 1 is consistent
  double clock_offset_s = 0.0;         ///< how late the magnetometers' stamps are, as estimated at the end
  double clock_sigma_s = 0.0;          ///< of it; 0: not estimated
  WarningLog warnings;
  std::optional<TruthFigures> truth;
  std::vector<StageFigures> stages;                   ///< against the truth, where there is one
  std::optional<CalibrationConsistency> calibration;  ///< nothing without a true calibration or an estimated one
  std::optional<StaleMap> stale_map;                  ///< nothing without a magnetic map

  double real_time_factor() const { return wall_s > 0.0 ? duration_s / wall_s : 0.0; }
};

/// Holds the best estimate of `record` against `truth`. `log_end`: the log's last stamp.
TruthFigures compare_with_truth(const EstimateRecord& record, const Trajectory& truth, Time log_end, RunStatus status);

/// Every kind of estimate that `record` holds against `truth`, the best last. A filter has the causal one alone.
/// `log_end`: the log's last stamp.
std::vector<StageFigures> compare_stages(const EstimateRecord& record, const Trajectory& truth, Time log_end);

/// summary.json of one estimator: the keys of docs/design/architecture.md; `warnings` is {kind: {count, first, at_s}}.
std::string to_json(const RunSummary& summary);

/// How a run was called: what config.yaml does not hold. Not what changes no result: threads, --resume.
struct CallRecord {
  RunCall call;
  std::optional<double> max_range_m;  ///< in force: of the call, else of the platform; nothing without LiDAR
  bool refines = false;               ///< by a batch, as call and options say
};

/// summary.json of the whole call. `inputs`: name and value of what was given on the command line.
std::string to_json(const std::vector<std::pair<std::string, std::string>>& inputs, const CallRecord& call,
                    const std::vector<RunSummary>& runs, const std::optional<Bound>& bound);

/// The bound of each stage, and how much of it each run's estimates leave.
std::string bound_text(const Bound& bound, const std::vector<RunSummary>& runs);

/// The A/B table: against the truth where there is one, else of what was seen.
std::string ab_table(const std::vector<RunSummary>& runs);

/// All warnings of all runs, one line a kind, each with its count and what was seen first; empty where there are none.
std::string warnings_text(const std::vector<RunSummary>& runs);

}  // namespace lodestone

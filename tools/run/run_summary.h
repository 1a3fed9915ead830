#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/evaluation/association.h"
#include "core/evaluation/consistency.h"
#include "core/evaluation/stale_map.h"
#include "core/options.h"
#include "core/warnings.h"
#include "core/work_times.h"
#include "tools/run/calibration_consistency.h"
#include "tools/run/run_call.h"
#include "tools/writers/estimate_record.h"

namespace lodestone {

struct Bound;

/// The end of a run.
enum class RunStatus {
  done,
  regained,     ///< lost for a time, and found again
  lost,         ///< at the end, the estimator had lost track
  interrupted,  ///< by a signal
  stopped       ///< the log became unusable
};

constexpr auto enum_names(RunStatus) {
  return EnumNames<RunStatus, 5>{{{RunStatus::done, "done"},
                                  {RunStatus::regained, "regained"},
                                  {RunStatus::lost, "lost"},
                                  {RunStatus::interrupted, "interrupted"},
                                  {RunStatus::stopped, "stopped"}}};
}

/// Largest position error of a successful run.
inline constexpr double kSuccess_m = 1.0;

/// A log may end with IMU samples after its last whole scan, and a ground truth a little before.
inline constexpr double kEndTolerance_s = 1.0;

/// Errors of the best estimate against the ground truth (interpolated at the estimate's stamps).
struct TruthFigures {
  PosePairs pairs;
  double ate_m = 0.0;               ///< unaligned rmse
  std::optional<double> ate_se3_m;  ///< nothing if the alignment is undetermined
  double max_error_m = 0.0;
  double heading_rmse_deg = 0.0;
  std::optional<double> nees_pose;  ///< per degree of freedom; nothing without usable covariances
  bool success = false;             ///< known position error always within kSuccess_m, up to the end of the log
};

/// Errors of one kind of estimate against the ground truth.
struct StageFigures {
  std::string name;  ///< causal: the newest states; smoothed: states as they leave the window; batch: of the whole log
  double ate_m = 0.0;
  double max_error_m = 0.0;
  std::optional<double> largest_jump_m;  ///< error of the motion between neighbouring poses; nothing for one pose
  double heading_rmse_deg = 0.0;
  std::optional<Consistency> consistency;  ///< nothing without usable covariances
  std::optional<double> ate_over_bound;    ///< nothing without a bound
  double share_within_100mm = 0.0;         ///< of the time from the first pose to the end of the log
  double share_within_1m = 0.0;            ///< of the same time
};

struct RunSummary {
  std::string estimator;
  std::string solver;  ///< library and linear solver; empty if the estimator minimizes no cost
  RunStatus status = RunStatus::done;
  std::int64_t scans = 0;
  double duration_s = 0.0;  ///< of the processed part of the log
  double wall_s = 0.0;      ///< reading, estimating and writing
  double peak_rss_mb = 0.0;
  std::int64_t degenerate_scans = 0;
  std::int64_t uncertain_scans = 0;  ///< with Health::uncertain
  bool saw_lidar = false;            ///< at least one scan was tested for degenerate directions
  bool saw_field = false;            ///< at least one array sample was on the map
  std::int64_t magnetic_rejected = 0;
  double refine_s = 0.0;               ///< part of wall_s: the batch refinement after the log's end
  WorkTimes work_s{};                  ///< parts of wall_s
  std::optional<double> lidar_nis;     ///< mean over the scans, per point; 1 is consistent
  std::optional<double> magnetic_nis;  ///< mean over the scans' array samples, per component; 1 is consistent
  double clock_offset_s = 0.0;         ///< delay of the magnetometers' stamps, final estimate
  double clock_sigma_s = 0.0;          ///< sigma of clock_offset_s; 0: not estimated
  std::vector<LostInterval> lost;      ///< without a pose in the trajectory
  WarningLog warnings;
  std::optional<TruthFigures> truth;
  std::vector<StageFigures> stages;                   ///< errors of each stage; empty without ground truth
  std::optional<CalibrationConsistency> calibration;  ///< nothing without a true calibration or an estimated one
  std::optional<StaleMap> stale_map;                  ///< nothing without a magnetic map

  double real_time_factor() const { return wall_s > 0.0 ? duration_s / wall_s : 0.0; }
};

/// Compares the best estimate of `record` with `truth`. `log_end`: the log's last stamp.
TruthFigures compare_with_truth(const EstimateRecord& record, const Trajectory& truth, Time log_end, RunStatus status);

/// Compares every kind of estimate in `record` with `truth`, the best last. A filter has only the causal estimate.
/// `log_end`: the log's last stamp.
std::vector<StageFigures> compare_stages(const EstimateRecord& record, const Trajectory& truth, Time log_end);

/// summary.json of one estimator. `warnings` is {kind: {count, first, at_s}}.
std::string to_json(const RunSummary& summary);

/// Arguments of a call that are not in config.yaml. Excludes arguments that change no result: threads, --resume.
struct CallRecord {
  RunCall call;
  std::optional<double> max_range_m;  ///< range used: of the call or of the platform; nothing without LiDAR
  bool refines = false;               ///< with batch refinement, by call or options
};

/// summary.json of the whole call. `inputs`: name and value of the command line's inputs.
std::string to_json(const std::vector<std::pair<std::string, std::string>>& inputs, const CallRecord& call,
                    const std::vector<RunSummary>& runs, const std::optional<Bound>& bound);

/// The bound of each stage, and the ratio of each run's error to the bound.
std::string bound_text(const Bound& bound, const std::vector<RunSummary>& runs);

/// The A/B table. Without ground truth, only figures of the runs themselves.
std::string ab_table(const std::vector<RunSummary>& runs);

/// All warnings of all runs, one line per kind with count and first occurrence; empty without warnings.
std::string warnings_text(const std::vector<RunSummary>& runs);

}  // namespace lodestone

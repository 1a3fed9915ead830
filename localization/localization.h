#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "core/error.h"
#include "core/geometry/trajectory.h"
#include "estimators/estimator.h"
#include "estimators/initialization/start_finder.h"
#include "factors/calibration_estimate.h"
#include "localization/site.h"

/// Localization of a log in prior maps, as `lodestone run` does it (docs/user/library.md). The quick checks of
/// --check-seconds are part of the command, not of this library.
namespace lodestone {

/// The initial pose is the map's origin, which is counted as run.initial_pose.
struct MapOrigin {};

/// Initial pose and velocity are those of a trajectory T_map_imu at the first scan's start. The clock must be the
/// log's.
struct PoseOfTrajectory {
  Trajectory trajectory;
  std::string file;  ///< named in messages
};

/// The initial pose is searched on the whole cloud map, with the first options.search.data_s of the log.
struct SearchedPose {};

/// Where a localization begins: a Pose is T_map_imu at the first scan's start; a StartHypothesis also has a velocity.
using InitialPose = std::variant<MapOrigin, Pose, PoseOfTrajectory, SearchedPose, StartHypothesis>;

/// One estimator's task.
struct LocalizationTask {
  std::string estimator = "smoother";  ///< one of estimator_names()
  InitialPose initial_pose = MapOrigin{};
  int threads = 0;                                     ///< 0: all of the machine; results do not depend on it
  std::function<bool(const ScanBundle&)> processed{};  ///< called after each bundle; false ends the log there
  std::function<bool(double)> refining{};  ///< gets the finished share of a batch refinement; false stops it
};

struct LocalizationResult {
  std::int64_t scans = 0;
  Time begin = 0;                     ///< start of the first scan
  Time end = 0;                       ///< end t_k of the last processed scan
  bool stopped = false;               ///< `processed` ended the log
  std::optional<InputError> failure;  ///< error of the log after its first bundle; estimates up to there are complete
  std::string solver;                 ///< library and linear solver of the estimator
  std::optional<CalibrationEstimate> calibration;  ///< changes of the platform's calibration, if estimated
  WarningLog warnings;                             ///< of maps, log and estimator
};

/// Keeps all estimates in memory, about 1 kB each.
struct EstimateCollector final : EstimateSink {
  std::vector<Estimate> causal_estimates;
  std::vector<Estimate> smoothed_estimates;  ///< empty without a batch refinement
  std::vector<Estimate> best_estimates;

  void causal(const Estimate& estimate) override { causal_estimates.push_back(estimate); }
  void smoothed(const Estimate& estimate) override { smoothed_estimates.push_back(estimate); }
  void best(const Estimate& estimate) override { best_estimates.push_back(estimate); }
};

/// Localizes a log of any supported format at `site` (load_site). The estimates go to `sink` while the log is read.
/// Deterministic: the same input gives the same bits. BLAS has one thread from then on.
///
/// Throws InputError, before the first estimate, for an unknown estimator, a map that the estimator lacks, an
/// unreadable log, a log without scans, and an initial pose that is outside the map or not found.
LocalizationResult localize(const std::string& log, const Site& site, const LocalizationTask& task, EstimateSink& sink);

/// The same for a source of measurements, for example a MeasurementList.
LocalizationResult localize(MeasurementSource& source, const Site& site, const LocalizationTask& task,
                            EstimateSink& sink);

/// The same for bundles. `next` gives them in order of time, and false after the last.
LocalizationResult localize(const std::function<bool(ScanBundle&)>& next, const Site& site,
                            const LocalizationTask& task, EstimateSink& sink);

// The steps of a localization, for callers that compose them otherwise.

/// T_map_imu at the first scan's start. None if the pose is to be searched. Throws InputError as initial_pose_from.
std::optional<Pose> pose_at_start(const InitialPose& initial_pose, Time start, WarningLog& warnings);

/// The estimator at the task's initial pose, which must not be a SearchedPose. `first`: the log's first bundle.
/// `warnings` must outlive the estimator. Throws InputError as localize.
std::unique_ptr<Estimator> estimator_at_start(const Site& site, const LocalizationTask& task, const ScanBundle& first,
                                              WarningLog& warnings);

/// What was passed to an estimator.
struct ProcessedBundles {
  std::unique_ptr<Estimator> estimator;  ///< not finished yet
  std::int64_t scans = 0;
  Time begin = 0;
  Time end = 0;
  bool stopped = false;
  std::optional<InputError> failure;
};

/// Makes an estimator with the first bundle and passes all bundles to the estimator. `processed` may be empty. An
/// InputError after the first bundle is a `failure` of the result. Throws InputError if there is no bundle.
ProcessedBundles process_bundles(const std::function<bool(ScanBundle&)>& next,
                                 const std::function<std::unique_ptr<Estimator>(const ScanBundle&)>& make_estimator,
                                 EstimateSink& sink, const std::function<bool(const ScanBundle&)>& processed);

}  // namespace lodestone

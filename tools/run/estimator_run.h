#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "core/measurements.h"
#include "estimators/estimator.h"
#include "frontends/configuration/platform.h"
#include "localization/site.h"
#include "tools/run/field_report.h"
#include "tools/run/run_summary.h"

namespace lodestone {

/// One estimator's pass over a log.
struct EstimatorRun {
  std::string name;
  /// Receives trajectory.tum, causal.tum, covariance.csv, diagnostics.csv, errors.csv and summary.json. If the
  /// calibration is estimated: also calibration.csv and platform.yaml (the latter not if the run lost track). With a
  /// field: also field_residuals.csv, stale_places.csv and field_cells.csv.
  std::filesystem::path folder;
  const Trajectory* truth = nullptr;                      ///< null: no errors
  std::string truth_file;                                 ///< named in warnings
  const CalibrationEstimate* true_calibration = nullptr;  ///< null: no errors of the calibration
  const Bound* bound = nullptr;                           ///< null: no comparison with the bound
  const Platform* platform = nullptr;                     ///< unchanged, as in its file; null: no platform.yaml
  std::string log;                                        ///< name of the log, for comments in files
  FieldReportInputs field;                                ///< without a map: no stale-map report
  bool refines = false;                                   ///< a batch refinement follows the log
  std::filesystem::path recording;  ///< receives all estimates when the pass has ended; empty: no recording
  bool resume = false;              ///< if there is a recording, replay it instead of estimating
  std::function<OpenedLog()> open;  ///< opens the log at its beginning; counts in wall_s
  std::function<std::unique_ptr<Estimator>(const ScanBundle&)> make_estimator;  ///< called with the first bundle
};

/// Results of a pass that stay in memory.
struct EstimatorOutcome {
  RunSummary summary;
  EstimateRecord record;
  std::vector<FieldRow> field_rows;  ///< of the stale-map report
  Time log_begin = 0;
  bool replayed = false;  ///< replayed; files that only a pass writes are those of the earlier call
};

/// Runs the estimator over the log. A signal (interrupt_requested) or an InputError of the source ends the run early:
/// existing results are written and marked, and the InputError is rethrown. A replayed pass reads the log again and
/// gives the same bytes. Throws Interrupted if a signal comes during a replay. `warnings`: shared with source and
/// estimator. Throws InputError if the log has no scan.
EstimatorOutcome run_estimator(const EstimatorRun& run, WarningLog& warnings);

}  // namespace lodestone

#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "core/measurements.h"
#include "estimators/estimator.h"
#include "frontends/configuration/platform.h"
#include "tools/run/field_report.h"
#include "tools/run/run_summary.h"

namespace lodestone {

/// A log as a sequence of bundles.
struct OpenedLog {
  Time begin = 0;
  Time end = 0;
  std::function<bool(ScanBundle&)> next;  ///< false at the end of the log
};

/// One estimator's pass over a log.
struct EstimatorRun {
  std::string name;
  /// Gets trajectory.tum, causal.tum, covariance.csv, diagnostics.csv, errors.csv, summary.json; where the calibration
  /// is estimated calibration.csv and platform.yaml (the latter not of a run that lost track); with a field
  /// field_residuals.csv, stale_places.csv, field_cells.csv.
  std::filesystem::path folder;
  const Trajectory* truth = nullptr;                      ///< null: no figures against the truth
  const CalibrationEstimate* true_calibration = nullptr;  ///< null: no figures of the estimated calibration
  const Bound* bound = nullptr;                           ///< null: none was asked for
  const Platform* platform = nullptr;                     ///< as its file states it; null: no platform.yaml
  std::string log;                                        ///< for comments
  FieldMaterial field;                                    ///< its map null: no stale-map report
  bool refines = false;                                   ///< the whole log is solved together at its end
  std::filesystem::path recording;  ///< gets all estimates once the pass has ended; empty: no such file
  bool resume = false;              ///< if there is a recording, replay it instead of estimating
  std::function<OpenedLog()> open;  ///< opens the log at its beginning; its time counts
  std::function<std::unique_ptr<Estimator>(const ScanBundle&)> make_estimator;  ///< called with the first bundle
};

/// What a pass leaves in memory, beside its files.
struct EstimatorOutcome {
  RunSummary summary;
  EstimateRecord record;
  std::vector<FieldRow> field_rows;  ///< of the stale-map report
  Time log_begin = 0;
  bool replayed = false;  ///< files that only the pass itself writes are those of the call before
};

/// Works off the log. A signal (interrupt_requested) or an InputError of the source ends it early: what there is is
/// written and marked; the InputError is thrown on. A replayed pass reads the log again and ends with the same bytes.
/// Throws Interrupted if a signal comes during a replay. `warnings`: the log that source and estimator write to. Throws
/// InputError where the log holds no scan.
EstimatorOutcome run_estimator(const EstimatorRun& run, WarningLog& warnings);

}  // namespace lodestone

#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "core/measurements.h"
#include "estimators/estimator.h"
#include "tools/run/field_report.h"
#include "tools/run/run_checkpoint.h"
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
  std::filesystem::path folder;  ///< gets trajectory.tum, causal.tum, covariance.csv, diagnostics.csv, errors.csv, summary.json;
                                 ///< with a field field_residuals.csv, stale_places.csv, field_cells.csv
  const Trajectory* truth = nullptr;  ///< null: no figures against the truth
  const Bound* bound = nullptr;       ///< null: none was asked for
  FieldMaterial field;                ///< its map null: no stale-map report
  RunCheckpoint* checkpoint = nullptr;  ///< null: the pass cannot be taken up again
  bool refines = false;                 ///< what comes after the log's end takes long
  bool resume = false;                  ///< go on from the checkpoint, where there is one
  std::function<OpenedLog()> open;    ///< opens the log at its beginning; its time counts
  std::function<std::unique_ptr<Estimator>(const ScanBundle&)> make_estimator;  ///< called with the first bundle
};

/// What a pass leaves in memory, beside its files.
struct EstimatorOutcome {
  RunSummary summary;
  EstimateRecord record;
  std::vector<FieldRow> field_rows;  ///< of the stale-map report
  Time log_begin = 0;
};

/// Works off the log. A signal (interrupt_requested) or an InputError of the source ends it early: what there is is
/// written and marked; the InputError is thrown on. A pass that was taken up ends with the bytes of an unbroken one, but for
/// what tells of wall time and memory. Throws Interrupted where a signal comes before it is where it was. `warnings` is the log that source and estimator write to.
/// Throws InputError where the log holds no scan.
EstimatorOutcome run_estimator(const EstimatorRun& run, WarningLog& warnings);

}  // namespace lodestone

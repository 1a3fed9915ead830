#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "core/measurements.h"
#include "estimators/estimator.h"
#include "tools/run/run_summary.h"

namespace lodestone {

/// One estimator's pass over a log.
struct EstimatorRun {
  std::string name;
  std::filesystem::path folder;  ///< gets trajectory.tum, causal.tum, covariance.csv, diagnostics.csv, summary.json
  Time log_begin = 0;
  Time log_end = 0;
  const Trajectory* truth = nullptr;  ///< null: no figures against the truth

  std::function<bool(ScanBundle&)> next_bundle;                              ///< false at the end of the log
  std::function<std::unique_ptr<Estimator>(const ScanBundle&)> make_estimator;  ///< called with the first bundle
};

/// What a pass leaves in memory, beside its files.
struct EstimatorOutcome {
  RunSummary summary;
  EstimateRecord record;
};

/// Works off the log. A signal (interrupt_requested) or an InputError of the source ends it early: what there is is
/// written and marked; the InputError is thrown on. `warnings` is the log that source and estimator write to.
/// Throws InputError where the log holds no scan.
EstimatorOutcome run_estimator(const EstimatorRun& run, WarningLog& warnings);

}  // namespace lodestone

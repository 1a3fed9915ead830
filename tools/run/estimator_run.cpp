#include "tools/run/estimator_run.h"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <optional>

#include "core/error.h"
#include "frontends/readers/text_file.h"
#include "frontends/readers/trajectory_file.h"
#include "tools/run/bound_run.h"
#include "tools/progress.h"
#include "tools/run/resources.h"
#include "tools/sinks/error_file.h"
#include "tools/sinks/estimate_files.h"

namespace lodestone {

namespace {

/// Hands every estimate to the files and to the record.
class BothSinks : public EstimateSink {
 public:
  BothSinks(EstimateSink& first, EstimateSink& second) : first_(first), second_(second) {}
  void causal(const Estimate& estimate) override {
    first_.causal(estimate);
    second_.causal(estimate);
  }
  void best(const Estimate& estimate) override {
    first_.best(estimate);
    second_.best(estimate);
  }
  void smoothed(const Estimate& estimate) override {
    first_.smoothed(estimate);
    second_.smoothed(estimate);
  }

 private:
  EstimateSink& first_;
  EstimateSink& second_;
};

double seconds_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

void count_steps(const EstimateRecord& record, RunSummary& summary, WarningLog& warnings) {
  double innovations = 0.0;
  int samples = 0;
  for (const EstimateRecord::Step& step : record.steps()) {
    if (step.diagnostics.magnetic_nis > 0.0) {
      innovations += step.diagnostics.magnetic_nis * step.diagnostics.magnetic_samples;
      samples += step.diagnostics.magnetic_samples;
    }
    if (step.diagnostics.degenerate_directions > 0) ++summary.degenerate_scans;
    summary.magnetic_rejected += step.diagnostics.magnetic_rejected;
    if (step.diagnostics.magnetic_samples > 0 && step.diagnostics.magnetic_set_aside >= step.diagnostics.magnetic_samples) {
      warnings.add("magnetometer.contradicted", "a magnetometer or several read what the rest of the array contradicts, and were "
                   "set aside, from " + format_stamp(step.time) + " s", step.time);
    }
    if (step.health == Health::lost) {
      warnings.add("run.lost", "the estimator no longer trusts its pose from " + format_stamp(step.time) + " s", step.time);
    }
  }
  if (samples > 0) summary.magnetic_nis = innovations / samples;
}

/// How late the magnetometers' stamps are, where that was estimated.
void tell_clock(const EstimateRecord& record, RunSummary& summary, WarningLog& warnings) {
  constexpr double kSigmas = 5.0;
  constexpr double kNotable_s = 0.003;
  if (record.steps().empty()) return;
  const EstimateRecord::Step& last = record.steps().back();
  summary.clock_offset_s = last.diagnostics.clock_offset_s;
  summary.clock_sigma_s = last.diagnostics.clock_sigma_s;
  const double late_s = std::abs(summary.clock_offset_s);
  if (summary.clock_sigma_s <= 0.0 || late_s < kSigmas * summary.clock_sigma_s || late_s < kNotable_s) return;
  warnings.add("magnetometer.clock", fmt::format("the magnetometers' stamps are {:.1f} ms too {} (one sigma {:.1f} ms), which was "
                                                 "estimated and taken into account", 1e3 * late_s,
                                                 summary.clock_offset_s > 0.0 ? "late" : "early", 1e3 * summary.clock_sigma_s), last.time);
}

/// Stretches in which the position is known to worse than half a metre, of the best estimate.
void warn_of_uncertainty(const EstimateRecord& record, WarningLog& warnings) {
  constexpr double kUncertain_m = 0.5;
  for (std::size_t i = 0; i < record.best().size(); ++i) {
    const double variance = record.covariances()[i].diagonal().tail<3>().maxCoeff();
    if (variance < kUncertain_m * kUncertain_m) continue;
    const Time time = record.best()[i].time;
    warnings.add("run.uncertain", fmt::format("the position is known to worse than {} m (one sigma) from {} s", kUncertain_m,
                                              format_stamp(time)), time);
  }
}

/// The error of every pose that the truth knows.
void write_errors_of(const EstimateRecord& record, const PosePairs& pairs, const std::filesystem::path& path) {
  std::vector<Matrix6> covariances;
  for (const PosePair& pair : pairs) covariances.push_back(record.covariances()[pair.estimate_index]);
  write_errors(path, error_rows(pairs, covariances));
}

}  // namespace

EstimatorOutcome run_estimator(const EstimatorRun& run, WarningLog& warnings) {
  reset_peak_memory();
  const auto start = std::chrono::steady_clock::now();
  EstimatorOutcome outcome;
  RunSummary& summary = outcome.summary;
  summary.estimator = run.name;
  const OpenedLog log = run.open();
  outcome.log_begin = log.begin;
  EstimateFiles files(run.folder);
  BothSinks sinks(files, outcome.record);
  std::unique_ptr<Estimator> estimator;
  std::optional<InputError> failure;
  ArrayLog readings(run.field.map != nullptr ? run.field.suite->magnetometers.size() : 0);
  Time first_start = 0;
  Time last_end = 0;
  {
    Progress progress(run.name, log.begin, log.end);
    try {
      ScanBundle bundle;
      while (log.next(bundle)) {
        if (!estimator) {
          estimator = run.make_estimator(bundle);
          first_start = bundle.scan.start;
        }
        estimator->process(bundle, sinks);
        if (run.field.map != nullptr) readings.add(bundle.magnetic);
        ++summary.scans;
        last_end = bundle.scan.end;
        progress.update(last_end);
        if (interrupt_requested()) {
          summary.status = RunStatus::interrupted;
          break;
        }
      }
      if (!estimator) throw InputError("the log holds no scan between its first and last IMU sample; nothing to estimate");
    } catch (const InputError& error) {
      if (!estimator) throw;
      failure = error;
      summary.status = RunStatus::stopped;
    }
    const auto log_end = std::chrono::steady_clock::now();
    estimator->finish(sinks);
    summary.refine_s = seconds_since(log_end);
  }
  summary.duration_s = to_seconds(last_end - first_start);
  count_steps(outcome.record, summary, warnings);
  tell_clock(outcome.record, summary, warnings);
  warn_of_uncertainty(outcome.record, warnings);
  const auto& steps = outcome.record.steps();
  if (summary.status == RunStatus::done && !steps.empty() && steps.back().health == Health::lost) {
    summary.status = RunStatus::lost;
  }
  std::string mark;
  if (summary.status != RunStatus::done) {
    mark = fmt::format("{} at {} s of {}", status_name(summary.status), format_stamp(last_end), format_stamp(log.end));
    if (failure) mark += fmt::format(": {}", failure->what());
    if (summary.status != RunStatus::lost) warnings.add(fmt::format("run.{}", status_name(summary.status)), mark, last_end);
  }
  files.finish(mark);
  if (run.field.map != nullptr) {
    FieldReport report = report_field(run.field, readings, outcome.record, warnings);
    write_field_report(run.folder, report);
    summary.stale_map = std::move(report.stale);
    outcome.field_rows = std::move(report.rows);
  }
  summary.wall_s = seconds_since(start);
  summary.peak_rss_mb = peak_memory_mb();
  if (run.truth != nullptr) summary.truth = compare_with_truth(outcome.record, *run.truth, log.end, summary.status);
  if (run.truth != nullptr) summary.stages = compare_stages(outcome.record, *run.truth);
  for (StageFigures& stage : summary.stages) {
    const Bound::Stage* least = run.bound == nullptr ? nullptr : run.bound->find(stage.name);
    if (least != nullptr && least->position_m > 0.0) stage.ate_over_bound = stage.ate_m / least->position_m;
  }
  if (summary.truth) write_errors_of(outcome.record, summary.truth->pairs, run.folder / "errors.csv");
  if (summary.truth && summary.truth->pairs.empty()) {
    warnings.add("run.truth", "no pose of the estimate lies within the truth's time; both must use one clock", last_end);
  }
  summary.warnings = warnings;
  write_text_file((run.folder / "summary.json").string(), to_json(summary));
  if (failure) throw *failure;
  return outcome;
}

}  // namespace lodestone

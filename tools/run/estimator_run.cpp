#include "tools/run/estimator_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <optional>

#include "core/error.h"
#include "estimators/factory.h"
#include "frontends/configuration/options.h"
#include "frontends/configuration/text_file.h"
#include "frontends/configuration/trajectory_file.h"
#include "localization/localization.h"
#include "tools/progress.h"
#include "tools/run/bound_run.h"
#include "tools/run/calibrated_platform.h"
#include "tools/run/calibration_file.h"
#include "tools/run/estimate_recording.h"
#include "tools/run/resources.h"
#include "tools/writers/error_file.h"
#include "tools/writers/estimate_files.h"

namespace lodestone {

namespace {

/// Passes every estimate to several sinks.
class ManySinks : public EstimateSink {
 public:
  explicit ManySinks(std::vector<EstimateSink*> sinks) : sinks_(std::move(sinks)) {}
  void causal(const Estimate& estimate) override {
    for (EstimateSink* sink : sinks_) sink->causal(estimate);
  }
  void best(const Estimate& estimate) override {
    for (EstimateSink* sink : sinks_) sink->best(estimate);
  }
  void smoothed(const Estimate& estimate) override {
    for (EstimateSink* sink : sinks_) sink->smoothed(estimate);
  }

 private:
  std::vector<EstimateSink*> sinks_;
};

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

void count_steps(const EstimateRecord& record, RunSummary& summary, WarningLog& warnings) {
  double innovations = 0.0;
  int samples = 0;
  double scans_nis = 0.0;
  int scans = 0;
  for (const EstimateRecord::Step& step : record.steps()) {
    if (step.diagnostics.magnetic_nis > 0.0) {
      innovations += step.diagnostics.magnetic_nis * step.diagnostics.magnetic_samples;
      samples += step.diagnostics.magnetic_samples;
    }
    if (step.diagnostics.lidar_nis > 0.0) {
      scans_nis += step.diagnostics.lidar_nis;
      ++scans;
    }
    if (step.diagnostics.degenerate_directions > 0) ++summary.degenerate_scans;
    if (step.health == Health::uncertain) ++summary.uncertain_scans;
    summary.saw_lidar = summary.saw_lidar || (step.diagnostics.direction_sigma_m.array() != 0.0).any();
    summary.saw_field = summary.saw_field || step.diagnostics.magnetic_samples > 0;
    summary.magnetic_rejected += step.diagnostics.magnetic_rejected;
    if (step.diagnostics.magnetic_samples > 0 &&
        step.diagnostics.magnetic_set_aside >= step.diagnostics.magnetic_samples) {
      warnings.add("magnetometer.contradicted",
                   "readings of one or several magnetometers contradict the rest of the array and were "
                   "rejected, from " +
                       format_stamp(step.time) + " s",
                   step.time);
    }
  }
  if (samples > 0) summary.magnetic_nis = innovations / samples;
  if (scans > 0) summary.lidar_nis = scans_nis / scans;
}

const char* explanation(HealthReason reason) {
  switch (reason) {
    case HealthReason::not_finite:
      return "the state is not a number";
    case HealthReason::covariance:
      return "the position's sigma exceeds 3 m";
    case HealthReason::unobserved:
      return "for long, no sensor observed a direction";
    case HealthReason::scan_off_map:
      return "scans do not fit the cloud map there";
    case HealthReason::field_off_map:
      return "readings do not fit the magnetic map there";
    case HealthReason::motion:
      return "the positions move otherwise than their velocities say";
    case HealthReason::searching:
    case HealthReason::none:
      break;
  }
  return "the position has not been found";
}

/// Warns of every interval without a usable pose, with the reason of its first scan.
void warn_of_loss(const EstimateRecord& record, WarningLog& warnings) {
  for (const LostInterval& interval : record.lost()) {
    HealthReason reason = HealthReason::none;
    for (const EstimateRecord::Step& step : record.steps()) {
      if (step.time < interval.from) continue;
      reason = step.reason;
      break;
    }
    warnings.add("run.lost",
                 fmt::format("lost from {}, {}: {}", span_text(interval.from, interval.to),
                             interval.regained ? "then found again" : "the end of the log", explanation(reason)),
                 interval.from);
  }
}

/// Reports the delay of the magnetometers' stamps, if it was estimated.
void report_clock_offset(const EstimateRecord& record, RunSummary& summary, WarningLog& warnings) {
  constexpr double kSigmas = 5.0;
  constexpr double kNotable_s = 0.003;
  if (record.steps().empty()) return;
  const EstimateRecord::Step& last = record.steps().back();
  summary.clock_offset_s = last.diagnostics.clock_offset_s;
  summary.clock_sigma_s = last.diagnostics.clock_sigma_s;
  const double late_s = std::abs(summary.clock_offset_s);
  if (summary.clock_sigma_s <= 0.0 || late_s < kSigmas * summary.clock_sigma_s || late_s < kNotable_s) return;
  warnings.add("magnetometer.clock",
               fmt::format("the magnetometers' stamps are {:.1f} ms too {} (sigma {:.1f} ms); this was "
                           "estimated and corrected",
                           1e3 * late_s, summary.clock_offset_s > 0.0 ? "late" : "early", 1e3 * summary.clock_sigma_s),
               last.time);
}

/// Warns of intervals in which the best estimate's position sigma exceeds half a metre.
void warn_of_uncertainty(const EstimateRecord& record, WarningLog& warnings) {
  constexpr double kUncertain_m = 0.5;
  for (std::size_t i = 0; i < record.best().size(); ++i) {
    const double variance = position_variance_m2(record.covariances()[i]);
    if (variance < kUncertain_m * kUncertain_m) continue;
    const Time time = record.best()[i].time;
    warnings.add("run.uncertain",
                 fmt::format("the position's sigma exceeds {} m from {} s", kUncertain_m, format_stamp(time)), time);
  }
}

/// Warns if the ground truth covers only a part of the estimate.
void warn_of_truth(const EstimatorRun& run, const Trajectory& estimate, const PosePairs& pairs, Time log_begin,
                   Time log_end, WarningLog& warnings) {
  if (estimate.empty()) return;
  if (!pairs.empty() && to_seconds(pairs.front().time - estimate.front().time) <= kEndTolerance_s &&
      to_seconds(estimate.back().time - pairs.back().time) <= kEndTolerance_s) {
    return;
  }
  const std::string sparse =
      pairs.empty() ? fmt::format("; it must have a pose every {} s", kLongestInterpolation_s) : std::string();
  warnings.add("run.truth",
               fmt::format("{} spans {}, the log {}: {} of {} poses are compared{}", run.truth_file,
                           span_text(run.truth->front().time, run.truth->back().time), span_text(log_begin, log_end),
                           pairs.size(), estimate.size(), sparse),
               estimate.front().time);
}

/// Writes the error of every pose with ground truth.
void write_errors_of(const EstimateRecord& record, const PosePairs& pairs, const std::filesystem::path& path) {
  std::vector<Matrix6> covariances;
  for (const PosePair& pair : pairs) covariances.push_back(record.covariances()[pair.estimate_index]);
  write_errors(path, error_rows(pairs, covariances));
}

/// Writes the estimated calibration, and the platform file for the next run.
void keep_calibration(const EstimatorRun& run, const CalibrationEstimate& calibration, const std::string& mark,
                      bool lost) {
  const SensorSuite& suite = *run.field.suite;
  write_calibration(run.folder / "calibration.csv", suite, calibration);
  if (run.platform == nullptr || lost) return;
  const std::string comment = fmt::format(
      "From {}, with the calibration that `lodestone run` estimated with {} from {}.\n"
      "{}"
      "calibration.csv in this folder lists the changes. Each calibration sigma is the largest remaining sigma of its "
      "axes and sensors.\n"
      "Use this file for other logs. A second run over the same log would use its data twice.",
      run.platform->file_name(), run.name, run.log, mark.empty() ? "" : mark + "\n");
  save_platform(calibrated_platform(*run.platform, suite, calibration), (run.folder / "platform.yaml").string(),
                comment);
}

/// Stands for an estimator whose estimates were recorded by an earlier call.
class ReplayedEstimator final : public Estimator {
 public:
  ReplayedEstimator(std::unique_ptr<Estimator> estimator, const EstimateRecording& recording)
      : estimator_(std::move(estimator)), recording_(recording) {}

  void process(const ScanBundle&, EstimateSink&) override { throw_if_interrupted(); }
  void finish(EstimateSink& sink) override { recording_.replay(sink); }
  std::string solver() const override { return estimator_->solver(); }
  /// Null: the file of the earlier call is kept.
  const CalibrationEstimate* calibration() const override { return nullptr; }

 private:
  std::unique_ptr<Estimator> estimator_;
  const EstimateRecording& recording_;
};

/// One pass over the log: feeds an estimator with bundles, or replays a recording of its estimates.
class Pass {
 public:
  Pass(const EstimatorRun& run, Clock::time_point start, OpenedLog log, EstimateSink& results, WarningLog& warnings)
      : run_(run),
        start_(start),
        log_(std::move(log)),
        results_(results),
        warnings_(warnings),
        readings_(run.field.map != nullptr ? run.field.suite->magnetometers.size() : 0),
        sinks_({&results}) {}

  /// From the first bundle to the last. Throws InputError if there is none.
  void process_log() {
    if (run_.resume && !run_.recording.empty()) recording_ = EstimateRecording::read(run_.recording);
    if (!recording_ && !run_.recording.empty()) record();
    Progress progress(recording_ ? run_.name + ", reading again" : run_.name, log_.begin, log_.end);
    bundles_ = process_bundles(
        log_.next, [this](const ScanBundle& first) { return make_estimator(first); }, sinks_,
        [&](const ScanBundle& bundle) {
          if (run_.field.map != nullptr) readings_.add(bundle.magnetic);
          last_end_ = bundle.scan.end;
          progress.update(last_end_);
          return !interrupt_requested();
        });
  }

  /// Outputs the remaining estimates. Sets `refine_s` and `wall_s`.
  void finish() {
    const auto worked_off = Clock::now();
    bundles_.estimator->finish(sinks_);
    if (recording_) {
      warnings_ = recording_->pass().warnings;  // includes the estimator's warnings
      record_ = recording_->pass();
      return;
    }
    if (const CalibrationEstimate* estimate = calibration()) {
      warn_of_calibration(*run_.field.suite, *estimate, last_end_, warnings_);
    }
    record_ = {seconds_since(start_), seconds_since(worked_off), peak_memory_mb(), work_times(), warnings_};
    for (std::size_t i = 0; i < work_before_.size(); ++i) record_.work_s[i] -= work_before_[i];
  }

  /// Completes the recording for --resume. If the disk is full, the run continues without it.
  void keep() {
    if (recorder_ == nullptr) return;
    try {
      recorder_->finish(record_);
    } catch (const InputError& error) {
      warn_of_recording(error);
    }
  }

  bool replayed() const { return recording_.has_value(); }
  const ProcessedBundles& bundles() const { return bundles_; }
  /// Null if the calibration is not estimated, or if a replay keeps the file of the earlier call.
  const CalibrationEstimate* calibration() const { return bundles_.estimator->calibration(); }
  const ArrayLog& readings() const { return readings_; }
  const PassRecord& record_of_pass() const { return record_; }

 private:
  std::unique_ptr<Estimator> make_estimator(const ScanBundle& first) const {
    auto estimator = run_.make_estimator(first);
    if (!recording_) return estimator;
    return std::make_unique<ReplayedEstimator>(std::move(estimator), *recording_);
  }

  void record() {
    try {
      recorder_ = std::make_unique<EstimateRecorder>(run_.recording);
      sinks_ = ManySinks({&results_, recorder_.get()});
    } catch (const InputError& error) {
      warn_of_recording(error);
    }
  }

  void warn_of_recording(const InputError& error) {
    recorder_.reset();
    warnings_.add("run.recording", fmt::format("--resume will run this estimator again: {}", error.what()), last_end_);
  }

  const EstimatorRun& run_;
  Clock::time_point start_;
  OpenedLog log_;
  EstimateSink& results_;
  WarningLog& warnings_;
  ArrayLog readings_;
  Time last_end_ = 0;
  WorkTimes work_before_ = work_times();
  std::optional<EstimateRecording> recording_;  // of an earlier call, to be replayed
  std::unique_ptr<EstimateRecorder> recorder_;  // of this pass
  ManySinks sinks_;
  ProcessedBundles bundles_;
  PassRecord record_;
};

}  // namespace

EstimatorOutcome run_estimator(const EstimatorRun& run, WarningLog& warnings) {
  reset_peak_memory();
  const auto start = Clock::now();
  EstimatorOutcome outcome;
  RunSummary& summary = outcome.summary;
  summary.estimator = run.name;
  OpenedLog log = run.open();
  outcome.log_begin = log.begin;
  const Time log_end = log.end;
  EstimateFiles files(run.folder);
  ManySinks sinks({&files, &outcome.record});
  Pass pass(run, start, std::move(log), sinks, warnings);
  pass.process_log();
  const ProcessedBundles& bundles = pass.bundles();
  if (bundles.stopped) summary.status = RunStatus::interrupted;
  if (bundles.failure) summary.status = RunStatus::stopped;
  pass.finish();
  outcome.replayed = pass.replayed();
  summary.refine_s = pass.record_of_pass().refine_s;
  // A signal also ends a refinement.
  if (summary.status == RunStatus::done && run.refines && interrupt_requested())
    summary.status = RunStatus::interrupted;
  const bool whole = summary.status == RunStatus::done;
  summary.scans = bundles.scans;
  summary.solver = bundles.estimator->solver();
  const Time last_end = bundles.end;
  summary.duration_s = to_seconds(last_end - bundles.begin);
  count_steps(outcome.record, summary, warnings);
  if (run.field.map != nullptr && uses_field(run.name) && !summary.saw_field && !outcome.record.steps().empty()) {
    warnings.add("run.field_unused",
                 "no reading lay on the magnetic map, so the run did not use it; is it the map of this site, in the "
                 "frame of the cloud map?",
                 outcome.record.steps().front().time);
  }
  report_clock_offset(outcome.record, summary, warnings);
  warn_of_uncertainty(outcome.record, warnings);
  warn_of_loss(outcome.record, warnings);
  summary.lost = outcome.record.lost();
  if (summary.status == RunStatus::done && !summary.lost.empty()) {
    summary.status = summary.lost.back().regained ? RunStatus::regained : RunStatus::lost;
  }
  std::string mark;
  if (summary.status != RunStatus::done && summary.status != RunStatus::regained) {
    mark = fmt::format("{} at {} s of {}", options_detail::write_value(summary.status), format_stamp(last_end),
                       format_stamp(log_end));
    if (bundles.failure) mark += fmt::format(": {}", bundles.failure->what());
    if (summary.status != RunStatus::lost && summary.status != RunStatus::regained)
      warnings.add(fmt::format("run.{}", options_detail::write_value(summary.status)), mark, last_end);
  }
  files.finish(mark);
  if (const CalibrationEstimate* calibration = pass.calibration()) {
    keep_calibration(run, *calibration, mark, summary.status == RunStatus::lost);
    if (run.true_calibration != nullptr) {
      summary.calibration = compare_calibration(*run.field.suite, *calibration, *run.true_calibration);
    }
  }
  if (whole) pass.keep();  // a replay does not write the calibration again
  if (run.field.map != nullptr) {
    FieldReport report = report_field(run.field, pass.readings(), outcome.record, warnings);
    write_field_report(run.folder, report);
    summary.stale_map = std::move(report.stale);
    outcome.field_rows = std::move(report.rows);
  }
  summary.wall_s = pass.record_of_pass().wall_s;
  summary.peak_rss_mb = pass.record_of_pass().peak_rss_mb;
  summary.work_s = pass.record_of_pass().work_s;
  if (run.truth != nullptr) summary.truth = compare_with_truth(outcome.record, *run.truth, log_end, summary.status);
  if (run.truth != nullptr) summary.stages = compare_stages(outcome.record, *run.truth, log_end);
  for (StageFigures& stage : summary.stages) {
    const Bound::Stage* least = run.bound == nullptr ? nullptr : run.bound->find(stage.name);
    if (least != nullptr && least->position_m > 0.0) stage.ate_over_bound = stage.ate_m / least->position_m;
  }
  if (summary.truth) write_errors_of(outcome.record, summary.truth->pairs, run.folder / "errors.csv");
  if (summary.truth)
    warn_of_truth(run, outcome.record.best(), summary.truth->pairs, outcome.log_begin, log_end, warnings);
  summary.warnings = warnings;
  write_text_file(run.folder / "summary.json", to_json(summary));
  if (bundles.failure) throw *bundles.failure;
  return outcome;
}

}  // namespace lodestone

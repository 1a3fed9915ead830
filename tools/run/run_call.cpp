#include "tools/run/run_call.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <set>

#include "core/error.h"
#include "core/nearest_name.h"
#include "core/thread_limit.h"
#include "estimators/factory.h"
#include "estimators/smoother/bound.h"
#include "frontends/configuration/missing_file.h"
#include "frontends/configuration/options.h"
#include "frontends/configuration/platform.h"
#include "frontends/configuration/text_file.h"
#include "frontends/configuration/trajectory_file.h"
#include "localization/automatic_initialization.h"
#include "localization/initial_pose.h"
#include "localization/localization.h"
#include "tools/commands.h"
#include "tools/origin_option.h"
#include "tools/progress.h"
#include "tools/report/overview.h"
#include "tools/run/bound_run.h"
#include "tools/run/estimator_run.h"
#include "tools/run/first_seconds.h"
#include "tools/run/folder_lock.h"
#include "tools/run/new_folder.h"
#include "tools/run/output_folder_check.h"
#include "tools/run/picture_series.h"
#include "tools/run/resumption.h"
#include "tools/run/stale_results.h"
#include "tools/writers/estimate_files.h"
#include "tools/writers/output_folder.h"

namespace lodestone {

namespace {

/// Data that all estimators of one call share.
struct RunInputs {
  Platform platform_file;  ///< unchanged: all magnetometers, its own range
  Site site;
  InitialPose initial_pose;
  Trajectory truth;
  std::optional<CalibrationEstimate> true_calibration;
};

bool is_automatic(const RunCall& call) {
  return call.initial_pose == "auto";
}

void check_call(const RunCall& call) {
  const std::vector<std::string> known = estimator_names();
  std::set<std::string> seen;
  for (const std::string& name : call.estimators) {
    if (std::find(known.begin(), known.end(), name) == known.end()) {
      throw InputError(fmt::format("--estimator: expected names from {}, found '{}'{}", join_names(known), name,
                                   suggestion(name, known)));
    }
    if (!seen.insert(name).second) throw InputError(fmt::format("--estimator: '{}' is named twice", name));
  }
  if (!(call.check_seconds >= 0.0)) {
    throw InputError(fmt::format("--check-seconds: expected seconds, or 0 for none, found {}", call.check_seconds));
  }
  if (call.bound && call.truth.empty()) throw InputError("--bound: requires the ground truth; add --truth");
  if (is_automatic(call) && call.cloud.empty() && !call.magnetic.empty()) {
    throw InputError(
        "--initial-pose auto: expected --cloud MAP.pcd, found only a magnetic map, in which places repeat; "
        "add the cloud map or set an initial pose");
  }
  if (!call.initial_pose.empty() && !is_automatic(call)) parse_initial_pose(call.initial_pose);
  if (!std::filesystem::exists(call.log)) throw missing_file(call.log, "log");
  check_folder(call.out);
  check_output_folder(call);
}

InitialPose initial_pose_of(const RunCall& call) {
  if (is_automatic(call)) return SearchedPose{};
  if (!call.initial_pose.empty()) return parse_initial_pose(call.initial_pose, call.origin_m);
  if (!call.initial_pose_from.empty()) {
    return PoseOfTrajectory{read_site_trajectory(call.initial_pose_from, call.origin_m), call.initial_pose_from};
  }
  return MapOrigin{};
}

/// All inputs except the maps.
RunInputs load_small_files(const RunCall& call) {
  RunInputs inputs;
  std::vector<std::string> settings = call.settings;
  if (!call.refine.empty()) settings.push_back("smoother.refine=" + call.refine);
  RunOptions options;
  load_options(load_configuration(call.configurations, settings), options);
  const MapFiles maps{call.cloud, call.magnetic, call.origin_m};
  inputs.platform_file = load_platform(call.platform, sensors_for(maps));
  inputs.site = site_without_maps(inputs.platform_file, options, maps, call.max_range_m);
  if (!call.refine.empty() && std::none_of(call.estimators.begin(), call.estimators.end(), can_refine)) {
    throw InputError("--refine: no chosen estimator supports it; add smoother or magnetic to --estimator");
  }
  if (!call.truth.empty()) inputs.truth = read_site_trajectory(call.truth, call.origin_m);
  if (!call.calibration_truth.empty()) {
    inputs.true_calibration = read_true_calibration(call.calibration_truth, inputs.site.platform.suite);
  }
  inputs.initial_pose = initial_pose_of(call);
  return inputs;
}

void load_maps(const RunCall& call, Site& site) {
  if (!call.cloud.empty()) {
    std::printf("%s: %s\n", call.cloud.c_str(), load_cloud(site, call.out).c_str());
  } else {
    std::printf("no --cloud: LiDAR is not used, the run is magnetic-inertial\n");
  }
  if (!call.magnetic.empty()) {
    std::printf("%s: %s\n", call.magnetic.c_str(), load_field(site).c_str());
  } else {
    std::printf("no --magnetic: magnetometers are not used, the run is LiDAR-inertial\n");
  }
}

/// The quick part of `lodestone check` on the first seconds of the log.
void run_first_checks(const RunCall& call, RunInputs& inputs) {
  if (call.check_seconds == 0.0) return;
  Site& site = inputs.site;
  const auto start_at = [&](Time time) -> std::optional<Pose> {
    if (std::holds_alternative<MapOrigin>(inputs.initial_pose)) return std::nullopt;
    WarningLog ignored;
    return pose_at_start(inputs.initial_pose, time, ignored);
  };
  check_first_seconds({call.log, site.platform, site.sensors, call.check_seconds, site.planes, start_at, call.origin_m},
                      site.warnings);
}

/// Refuses an unreadable log, and ground truth of another drive, before the maps are loaded, which may take minutes.
void check_log(const RunCall& call, const RunInputs& inputs) {
  WarningLog ignored;  // the estimators' passes report these warnings
  const OpenedLog log = open_bundles(call.log, inputs.site, ignored);
  if (call.truth.empty()) return;
  const Time from = inputs.truth.front().time, to = inputs.truth.back().time;
  if (to >= log.begin && from <= std::max(log.begin, log.end)) return;
  throw InputError(
      fmt::format("{}: no time in common with the log: it spans {}, and {} {}; use the ground truth "
                  "of this drive, with the log's clock",
                  call.truth, span_text(from, to), call.log, span_text(log.begin, log.end)));
}

struct LogSpan {
  Time begin = 0;
  Time end = 0;
};

/// Shows the progress of a refinement. A signal ends the refinement.
std::function<bool(double)> refining_progress(const std::string& name, const std::shared_ptr<const LogSpan>& log) {
  const auto progress = std::make_shared<std::unique_ptr<Progress>>();
  return [name, log, progress](double share) {
    if (*progress == nullptr) *progress = std::make_unique<Progress>(name + ", batch", log->begin, log->end);
    (*progress)->update(log->begin + static_cast<Time>(share * static_cast<double>(log->end - log->begin)));
    return !interrupt_requested();
  };
}

/// The bound, if the call has --bound.
std::optional<Bound> find_bound(const RunCall& call, const RunInputs& inputs) {
  if (!call.bound) return std::nullopt;
  WarningLog ignored;  // the estimators' passes report these warnings
  const auto open = [&]() { return open_bundles(call.log, inputs.site, ignored); };
  const auto make = [&](const ScanBundle& first) {
    const Pose start = initial_pose_from(inputs.truth, call.truth, first.scan.start);
    return make_estimator("smoother", bound_input(estimator_input(inputs.site, start, &ignored), inputs.truth));
  };
  return run_bound(open, make, inputs.truth, std::filesystem::path(call.out) / "bound.csv");
}

EstimatorOutcome run_one(const std::string& name, const RunCall& call, const RunInputs& inputs, const Bound* bound) {
  const Site& site = inputs.site;
  WarningLog warnings = site.warnings;
  EstimatorRun run;
  run.recording = recording_of(call, name);
  run.resume = call.resume;
  run.refines = site.options.smoother.refine == Refinement::batch;
  run.bound = bound;
  run.platform = &inputs.platform_file;
  run.log = call.log;
  run.name = name;
  run.folder = std::filesystem::path(call.out) / name;
  run.truth = call.truth.empty() ? nullptr : &inputs.truth;
  run.truth_file = call.truth;
  run.true_calibration = inputs.true_calibration ? &*inputs.true_calibration : nullptr;
  run.field = {site.field.get(), &site.platform.suite, &site.options};
  const auto span = std::make_shared<LogSpan>();
  run.open = [&]() {
    OpenedLog log = open_bundles(call.log, site, warnings);
    span->begin = log.begin;
    span->end = log.end;
    return log;
  };
  LocalizationTask task;
  task.estimator = name;
  task.initial_pose = inputs.initial_pose;
  task.refining = refining_progress(name, span);
  run.make_estimator = [&](const ScanBundle& first) { return estimator_at_start(site, task, first, warnings); };
  return run_estimator(run, warnings);
}

/// Searches the initial pose once for all estimators.
void search_initial_pose(const RunCall& call, RunInputs& inputs) {
  WarningLog ignored;  // the estimators' passes report these warnings
  const OpenedLog log = open_bundles(call.log, inputs.site, ignored);
  const FoundInitialPose found = find_initial_pose(call.log, estimator_input(inputs.site, {}, nullptr), log.next,
                                                   inputs.site.warnings, call.origin_m);
  std::printf("%s\n", found.description.c_str());
  inputs.initial_pose = found.start;
}

std::vector<std::pair<std::string, std::string>> inputs_of(const RunCall& call, const RunInputs& inputs,
                                                           const RunIdentity& identity) {
  const auto* found = std::get_if<StartHypothesis>(&inputs.initial_pose);
  return {{"lodestone", LODESTONE_VERSION},
          {"log", call.log},
          {"platform", call.platform},
          {"cloud", call.cloud},
          {"magnetic", call.magnetic},
          {"truth", call.truth},
          {"calibration_truth", call.calibration_truth},
          {"initial_pose", call.initial_pose},
          {"initial_pose_from", call.initial_pose_from},
          {"initial_pose_found", found != nullptr ? pose_text(found->T_map_imu, call.origin_m) : ""},
          {"identity", digest(identity)}};
}

CallRecord record_of(const RunCall& call, const RunInputs& inputs) {
  CallRecord record{call, std::nullopt, inputs.site.options.smoother.refine == Refinement::batch};
  if (!call.cloud.empty()) record.max_range_m = inputs.site.platform.suite.lidar.max_range_m;
  return record;
}

int exit_code_of(const std::vector<RunSummary>& runs) {
  int code = exit_code::done;
  for (const RunSummary& run : runs) {
    if (run.status == RunStatus::interrupted) return exit_code::interrupted;
    if (!run.lost.empty()) code = exit_code::track_lost;
  }
  return code;
}

void write_georeferenced(const std::filesystem::path& folder, const Trajectory& trajectory, const Vector3& origin_m) {
  if (origin_m.isZero(0.0) || trajectory.empty()) return;
  write_tum(folder / "georeferenced.tum", georeferenced(trajectory, origin_m), kTrajectoryColumns);
}

/// Writes the data of log and maps that a report requires.
void keep_overview(const RunCall& call, const RunInputs& inputs, Time log_begin, const std::vector<Time>& scans,
                   const Trajectory& first_estimate) {
  OverviewInput input{log_begin,
                      call.truth.empty() ? nullptr : &inputs.truth,
                      inputs.site.field.get(),
                      call.cloud,
                      call.origin_m,
                      scans,
                      first_estimate};
  write_overview(std::filesystem::path(call.out) / "overview", input);
  std::printf("for a report on one page: lodestone report %s\n", call.out.c_str());
}

}  // namespace

int execute(const RunCall& call) {
  check_call(call);
  const NewFolder refused_leaves_nothing(call.out);
  std::optional<FolderLock> lock(call.out);  // before the maps are loaded
  const ThreadLimit limit(call.threads.value_or(0));
  RunInputs inputs = load_small_files(call);
  check_log(call, inputs);
  throw_if_interrupted();
  load_maps(call, inputs.site);
  throw_if_interrupted();
  run_first_checks(call, inputs);
  throw_if_interrupted();
  const std::filesystem::path out = made_folder(call.out);
  if (!lock->locked()) lock.emplace(out);  // the folder is new
  const RunIdentity identity = identify(call, inputs.site.options);
  if (const auto code = begin_or_resume(call, identity)) return *code;
  write_text_file(
      (out / "config.yaml").string(),
      "# All options of this run, for --config. The other arguments of the call are in summary.json: call.\n" +
          save_options(inputs.site.options));
  StaleResults stale(out, estimator_names());

  if (is_automatic(call)) search_initial_pose(call, inputs);
  const std::optional<Bound> bound = find_bound(call, inputs);
  throw_if_interrupted();
  std::vector<RunSummary> summaries;
  std::vector<PictureSeries> series;
  std::vector<EstimatorOutcome> outcomes;
  Time log_begin = 0;
  for (const std::string& name : call.estimators) {
    EstimatorOutcome outcome = run_one(name, call, inputs, bound ? &*bound : nullptr);
    series.push_back(picture_series(outcome, inputs.truth));
    write_georeferenced(out / name, series.back().trajectory, call.origin_m);
    log_begin = outcome.log_begin;
    if (outcome.replayed) stale.keep_calibration(out / name);
    summaries.push_back(outcome.summary);
    outcomes.push_back(std::move(outcome));
    write_text_file(out / "summary.json",
                    to_json(inputs_of(call, inputs, identity), record_of(call, inputs), summaries, bound));
    if (summaries.back().status == RunStatus::interrupted) break;
  }
  std::printf("\n%s\n%s", ab_table(summaries).c_str(), warnings_text(summaries).c_str());
  for (const RunSummary& summary : summaries) {
    if (!summary.solver.empty()) std::printf("%s: solved by %s\n", summary.estimator.c_str(), summary.solver.c_str());
  }
  if (bound) std::printf("%s\n", bound_text(*bound, summaries).c_str());
  for (const RunSummary& summary : summaries) {
    if (summary.stale_map) std::printf("%s", stale_map_text(summary.estimator, *summary.stale_map).c_str());
  }
  if (inputs.site.field != nullptr) write_stale_map_pictures(out / "pictures", *inputs.site.field, outcomes);
  const std::vector<Time> scans = scan_ends(outcomes);
  if (!call.truth.empty()) {
    write_pictures(out / "pictures", inputs.site.field.get(), inputs.truth, scans, series);
  }
  if (inputs.site.field != nullptr || !call.truth.empty()) std::printf("pictures: %s\n", (out / "pictures").c_str());
  keep_overview(call, inputs, log_begin, scans, series.front().trajectory);
  const int code = exit_code_of(summaries);
  if (code != exit_code::interrupted) {
    stale.remove();
    finish_recordings(call);
  }
  return code;
}

}  // namespace lodestone

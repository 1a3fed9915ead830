#include "tools/run/run_call.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <set>

#include "core/error.h"
#include "core/nearest_name.h"
#include "estimators/factory.h"
#include "estimators/smoother/bound.h"
#include "frontends/configuration/magnetometer_choice.h"
#include "frontends/configuration/options.h"
#include "frontends/configuration/platform.h"
#include "frontends/configuration/text_file.h"
#include "frontends/configuration/trajectory_file.h"
#include "frontends/maps/magnetic_map_file.h"
#include "frontends/maps/ndt_map.h"
#include "frontends/maps/plane_map_loader.h"
#include "frontends/synchronizer/bag_source.h"
#include "frontends/synchronizer/synchronizer.h"
#include "tools/commands.h"
#include "tools/progress.h"
#include "tools/report/overview.h"
#include "tools/run/automatic_initialization.h"
#include "tools/run/bound_run.h"
#include "tools/run/estimator_run.h"
#include "tools/run/first_seconds.h"
#include "tools/run/folder_lock.h"
#include "tools/run/initial_pose.h"
#include "tools/run/output_folder_check.h"
#include "tools/run/picture_series.h"
#include "tools/run/resources.h"
#include "tools/run/resumption.h"
#include "tools/run/stale_results.h"
#include "tools/writers/output_file.h"

namespace lodestone {

namespace {

/// Data that all estimators of one call share.
struct RunInputs {
  Platform platform;
  Platform platform_file;  ///< unchanged: all magnetometers, its own range
  RunOptions options;
  std::shared_ptr<const PlaneMapSource> planes;
  std::shared_ptr<const MagneticMap> field;
  std::shared_ptr<ScanMatcher> matcher;  ///< null without estimator ndt
  Trajectory truth;
  std::optional<CalibrationEstimate> true_calibration;
  Trajectory initial_poses;  ///< of --initial-pose-from
  SensorChoice sensors;
  std::optional<StartHypothesis> found;  ///< with --initial-pose auto
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
  if (call.cloud.empty() && call.magnetic.empty()) {
    throw InputError("no map: set --cloud MAP.pcd, --magnetic FIELD.yaml, or both");
  }
  if (call.max_range_m && !(*call.max_range_m > 0.0)) {
    throw InputError(fmt::format("--max-range: expected metres above 0, found {}", *call.max_range_m));
  }
  if (call.threads && *call.threads < 1) {
    throw InputError(fmt::format("--threads: expected at least 1, found {}", *call.threads));
  }
  if (!(call.check_seconds >= 0.0)) {
    throw InputError(fmt::format("--check-seconds: expected seconds, or 0 for none, found {}", call.check_seconds));
  }
  if (call.bound && call.truth.empty()) throw InputError("--bound: requires the ground truth; add --truth");
  if (is_automatic(call) && call.cloud.empty()) {
    throw InputError(
        "--initial-pose auto: expected --cloud MAP.pcd, found only a magnetic map, in which places repeat; "
        "add the cloud map or set an initial pose");
  }
  if (!call.initial_pose.empty() && !is_automatic(call)) parse_initial_pose(call.initial_pose);
  if (!std::filesystem::exists(call.log)) throw InputError(fmt::format("{}: no such log", call.log));
  check_folder(call.out);
  check_output_folder(call);
}

/// All inputs except the maps.
RunInputs load_small_files(const RunCall& call) {
  RunInputs inputs;
  std::vector<std::string> settings = call.settings;
  if (!call.refine.empty()) settings.push_back("smoother.refine=" + call.refine);
  load_options(load_configuration(call.configurations, settings), inputs.options);
  inputs.platform_file = load_platform(call.platform);
  inputs.platform = inputs.platform_file;
  if (!call.magnetic.empty()) choose_magnetometers(inputs.options.magnetic.magnetometers, inputs.platform);
  if (!call.refine.empty() && std::none_of(call.estimators.begin(), call.estimators.end(), can_refine)) {
    throw InputError("--refine: no chosen estimator supports it; add smoother or magnetic to --estimator");
  }
  if (call.max_range_m) inputs.platform.suite.set_max_range(*call.max_range_m);
  if (!call.truth.empty()) inputs.truth = read_trajectory(call.truth);
  if (!call.calibration_truth.empty()) {
    inputs.true_calibration = read_true_calibration(call.calibration_truth, inputs.platform.suite);
  }
  if (!call.initial_pose_from.empty()) inputs.initial_poses = read_trajectory(call.initial_pose_from);
  inputs.sensors.lidar = !call.cloud.empty();
  inputs.sensors.magnetometers = !call.magnetic.empty();
  inputs.sensors.wheels = inputs.options.wheels.enabled;
  return inputs;
}

void load_maps(const RunCall& call, RunInputs& inputs, WarningLog& warnings) {
  if (!call.cloud.empty()) {
    const LoadedPlanes loaded =
        load_planes(call.cloud, inputs.options.lidar.map, inputs.platform.suite.lidars(), call.out, warnings);
    inputs.planes = loaded.source;
    std::printf("%s: %s\n", call.cloud.c_str(), loaded.description.c_str());
    if (std::find(call.estimators.begin(), call.estimators.end(), "ndt") != call.estimators.end()) {
      inputs.matcher =
          load_ndt_map(call.cloud, inputs.options.ndt.registration, inputs.platform.suite.lidars(), warnings);
    }
  } else {
    std::printf("no --cloud: LiDAR is not used, the run is magnetic-inertial\n");
  }
  if (!call.magnetic.empty()) {
    inputs.field =
        std::make_shared<MagneticMap>(read_magnetic_map(call.magnetic, inputs.options.magnetic.map.max_bytes()));
    if (inputs.platform.magnetometers.empty()) {
      throw InputError(fmt::format(
          "{}: there are no magnetometers, but --magnetic requires them; add them under 'magnetometers', or "
          "omit --magnetic",
          inputs.platform.file_name()));
    }
    const FieldGrid& grid = inputs.field->grid();
    std::printf("%s: %d x %d nodes of %g m, %zu layer%s\n", call.magnetic.c_str(), grid.columns, grid.rows,
                grid.resolution_m, grid.heights_m.size(), grid.heights_m.size() == 1 ? "" : "s");
  } else {
    std::printf("no --magnetic: magnetometers are not used, the run is LiDAR-inertial\n");
  }
}

/// The quick part of `lodestone check` on the first seconds of the log.
void run_first_checks(const RunCall& call, const RunInputs& inputs, WarningLog& warnings) {
  if (call.check_seconds == 0.0) return;
  const auto start_at = [&](Time time) -> std::optional<Pose> {
    if (is_automatic(call) || (call.initial_pose.empty() && call.initial_pose_from.empty())) return std::nullopt;
    if (!call.initial_pose.empty()) return parse_initial_pose(call.initial_pose);
    return initial_pose_from(inputs.initial_poses, call.initial_pose_from, time);
  };
  check_first_seconds({call.log, inputs.platform, inputs.sensors, call.check_seconds, inputs.planes, start_at},
                      warnings);
}

/// An initial pose outside the cloud map can only fail, and is refused before the run.
void check_within_map(const RunCall& call, const RunInputs& inputs, const Pose& pose, Time time, WarningLog& warnings) {
  const Vector3& p = pose.position;
  if (inputs.planes != nullptr) {
    double reach = 0.0;
    for (const LidarModel& lidar : inputs.platform.suite.lidars()) reach = std::max(reach, lidar.max_range_m);
    const auto map = inputs.planes->around(p);
    const bool seen = std::any_of(map->planes().begin(), map->planes().end(), [&](const Plane& plane) {
      return (plane.center.cast<double>() - p).squaredNorm() < reach * reach;
    });
    if (!seen) {
      throw InputError(fmt::format(
          "{}: this map has no plane within the LiDAR's range of {} m of the initial pose ({:.2f} {:.2f} {:.2f}); "
          "check --initial-pose and the map's frame",
          call.cloud, reach, p.x(), p.y(), p.z()));
    }
  }
  if (inputs.field != nullptr && !inputs.field->query(p, FieldInterpolation::bilinear)) {
    warnings.add("run.start_off_field",
                 fmt::format("at the initial pose ({:.2f} {:.2f} {:.2f}) there is no field in {}", p.x(), p.y(), p.z(),
                             call.magnetic),
                 time);
  }
}

Pose choose_initial_pose(const RunCall& call, const RunInputs& inputs, Time time, WarningLog& warnings) {
  if (inputs.found) return inputs.found->T_map_imu;
  if (!call.initial_pose.empty()) return parse_initial_pose(call.initial_pose);
  if (!call.initial_pose_from.empty()) return initial_pose_from(inputs.initial_poses, call.initial_pose_from, time);
  warnings.add("run.initial_pose",
               "there is no initial pose: the map's origin is used; set --initial-pose or --initial-pose-from", time);
  return {};
}

/// The log and its synchronizer. They live as long as the function that reads them.
struct LogReader {
  LogReader(const RunCall& call, const RunInputs& inputs, WarningLog& warnings)
      : source(call.log, inputs.platform, warnings, inputs.sensors),
        synchronizer(source, inputs.platform.suite, warnings, inputs.sensors) {}
  BagSource source;
  Synchronizer synchronizer;
};

OpenedLog open_log(const RunCall& call, const RunInputs& inputs, WarningLog& warnings) {
  const auto reader = std::make_shared<LogReader>(call, inputs, warnings);
  return {reader->source.begin_time(), reader->source.end_time(),
          [reader](ScanBundle& bundle) { return reader->synchronizer.next(bundle); }};
}

/// Refuses an unreadable log before the maps are loaded, which may take minutes.
void check_log(const RunCall& call, const RunInputs& inputs) {
  WarningLog ignored;  // the estimators' passes report these warnings
  BagSource(call.log, inputs.platform, ignored, inputs.sensors);
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
  const auto open = [&]() { return open_log(call, inputs, ignored); };
  const auto make = [&](const ScanBundle& first) {
    const Pose start = initial_pose_from(inputs.truth, call.truth, first.scan.start);
    return make_estimator("smoother", bound_input({inputs.platform.suite, inputs.planes, inputs.field, start,
                                                   Vector3::Zero(), inputs.options, &ignored, nullptr, nullptr},
                                                  inputs.truth));
  };
  return run_bound(open, make, inputs.truth, std::filesystem::path(call.out) / "bound.csv");
}

EstimatorOutcome run_one(const std::string& name, const RunCall& call, const RunInputs& inputs, const Bound* bound,
                         WarningLog warnings) {
  EstimatorRun run;
  run.recording = recording_of(call, name);
  run.resume = call.resume;
  run.refines = inputs.options.smoother.refine == Refinement::batch;
  run.bound = bound;
  run.platform = &inputs.platform_file;
  run.log = call.log;
  run.name = name;
  run.folder = std::filesystem::path(call.out) / name;
  run.truth = call.truth.empty() ? nullptr : &inputs.truth;
  run.true_calibration = inputs.true_calibration ? &*inputs.true_calibration : nullptr;
  run.field = {inputs.field.get(), &inputs.platform.suite, &inputs.options};
  const auto span = std::make_shared<LogSpan>();
  run.open = [&]() {
    OpenedLog log = open_log(call, inputs, warnings);
    span->begin = log.begin;
    span->end = log.end;
    return log;
  };
  run.make_estimator = [&](const ScanBundle& first) {
    const Pose start = choose_initial_pose(call, inputs, first.scan.start, warnings);
    check_within_map(call, inputs, start, first.scan.start, warnings);
    EstimatorInput input{inputs.platform.suite,
                         inputs.planes,
                         inputs.field,
                         start,
                         Vector3::Zero(),
                         inputs.options,
                         &warnings,
                         nullptr,
                         refining_progress(name, span),
                         inputs.matcher};
    if (inputs.found) input = begin_at(*inputs.found, std::move(input));
    return make_estimator(name, input);
  };
  return run_estimator(run, warnings);
}

/// Searches the initial pose once for all estimators.
void search_initial_pose(const RunCall& call, RunInputs& inputs, WarningLog& warnings) {
  WarningLog ignored;  // the estimators' passes report these warnings
  const OpenedLog log = open_log(call, inputs, ignored);
  const EstimatorInput input{inputs.platform.suite, inputs.planes, inputs.field, {}, Vector3::Zero(),
                             inputs.options,        nullptr,       nullptr,      {}};
  inputs.found = find_initial_pose(call.log, input, log.next, warnings);
}

std::vector<std::pair<std::string, std::string>> inputs_of(const RunCall& call, const RunInputs& inputs,
                                                           const RunIdentity& identity) {
  return {{"lodestone", LODESTONE_VERSION},
          {"log", call.log},
          {"platform", call.platform},
          {"cloud", call.cloud},
          {"magnetic", call.magnetic},
          {"truth", call.truth},
          {"calibration_truth", call.calibration_truth},
          {"initial_pose", call.initial_pose},
          {"initial_pose_from", call.initial_pose_from},
          {"initial_pose_found", inputs.found ? pose_text(inputs.found->T_map_imu) : ""},
          {"identity", digest(identity)}};
}

CallRecord record_of(const RunCall& call, const RunInputs& inputs) {
  CallRecord record{call, std::nullopt, inputs.options.smoother.refine == Refinement::batch};
  if (!call.cloud.empty()) record.max_range_m = inputs.platform.suite.lidar.max_range_m;
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

/// Writes the data of log and maps that a report requires.
void keep_overview(const RunCall& call, const RunInputs& inputs, Time log_begin,
                   const std::vector<PictureSeries>& series) {
  OverviewInput input{log_begin, call.truth.empty() ? nullptr : &inputs.truth, inputs.field.get(), call.cloud, {}};
  for (const PictureSeries& one : series) input.estimates.push_back(&one.trajectory);
  write_overview(std::filesystem::path(call.out) / "overview", input);
  std::printf("for a report on one page: lodestone report %s\n", call.out.c_str());
}

}  // namespace

int execute(const RunCall& call) {
  catch_interrupts();
  check_call(call);
  std::optional<FolderLock> lock(call.out);  // before the maps are loaded
  const ThreadLimit limit(call.threads.value_or(0));
  WarningLog shared;
  RunInputs inputs = load_small_files(call);
  check_log(call, inputs);
  load_maps(call, inputs, shared);
  run_first_checks(call, inputs, shared);
  const std::filesystem::path out = made_folder(call.out);
  if (!lock->locked()) lock.emplace(out);  // the folder is new
  const RunIdentity identity = identify(call, inputs.options);
  if (const auto code = begin_or_resume(call, identity)) return *code;
  write_text_file(
      (out / "config.yaml").string(),
      "# All options of this run, for --config. The other arguments of the call are in summary.json: call.\n" +
          save_options(inputs.options));
  StaleResults stale(out, estimator_names());

  if (is_automatic(call)) search_initial_pose(call, inputs, shared);
  const std::optional<Bound> bound = find_bound(call, inputs);
  std::vector<RunSummary> summaries;
  std::vector<PictureSeries> series;
  std::vector<EstimatorOutcome> outcomes;
  Time log_begin = 0;
  for (const std::string& name : call.estimators) {
    EstimatorOutcome outcome = run_one(name, call, inputs, bound ? &*bound : nullptr, shared);
    series.push_back(picture_series(outcome));
    log_begin = outcome.log_begin;
    if (outcome.replayed) stale.keep_calibration(out / name);
    summaries.push_back(outcome.summary);
    outcomes.push_back(std::move(outcome));
    write_text_file((out / "summary.json").string(),
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
  if (inputs.field != nullptr) write_stale_map_pictures(out / "pictures", *inputs.field, outcomes);
  if (!call.truth.empty()) {
    write_pictures(out / "pictures", inputs.field.get(), inputs.truth, series);
  }
  if (inputs.field != nullptr || !call.truth.empty()) std::printf("pictures: %s\n", (out / "pictures").c_str());
  keep_overview(call, inputs, log_begin, series);
  const int code = exit_code_of(summaries);
  if (code != exit_code::interrupted) {
    stale.remove();
    remove_recordings(call);
  }
  return code;
}

}  // namespace lodestone

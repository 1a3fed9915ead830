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
#include "frontends/maps/plane_map_loader.h"
#include "frontends/synchronizer/bag_source.h"
#include "frontends/synchronizer/synchronizer.h"
#include "tools/commands.h"
#include "tools/progress.h"
#include "tools/report/overview.h"
#include "tools/run/automatic_start.h"
#include "tools/run/bound_run.h"
#include "tools/run/estimator_run.h"
#include "tools/run/first_seconds.h"
#include "tools/run/initial_pose.h"
#include "tools/run/picture_series.h"
#include "tools/run/resources.h"
#include "tools/run/results_apart.h"
#include "tools/run/resumption.h"
#include "tools/run/stale_results.h"
#include "tools/writers/output_file.h"

namespace lodestone {

namespace {

/// Everything that the estimators of one call share.
struct RunMaterial {
  Platform platform;
  Platform stated;  ///< the platform file's: all magnetometers, its own range
  RunOptions options;
  std::shared_ptr<const PlaneMapSource> planes;
  std::shared_ptr<const MagneticMap> field;
  Trajectory truth;
  std::optional<CalibrationEstimate> true_calibration;
  Trajectory start;
  SensorChoice sensors;
  std::optional<AutomaticStart> found;  ///< with --initial-pose auto
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
    throw InputError("no map: give --cloud MAP.pcd, --magnetic FIELD.yaml, or both");
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
  if (call.bound && call.truth.empty()) throw InputError("--bound: it holds at the true trajectory; give --truth too");
  if (is_automatic(call) && call.cloud.empty()) {
    throw InputError(
        "--initial-pose auto: expected --cloud MAP.pcd, found a magnetic map alone, in which places repeat; "
        "add the cloud map or give the start's pose");
  }
  if (!call.initial_pose.empty() && !is_automatic(call)) parse_initial_pose(call.initial_pose);
  if (!std::filesystem::exists(call.log)) throw InputError(fmt::format("{}: no such log", call.log));
  check_folder(call.out);
  check_results_apart(call);
}

/// Everything but the maps.
RunMaterial load_small_files(const RunCall& call) {
  RunMaterial material;
  std::vector<std::string> settings = call.settings;
  if (!call.refine.empty()) settings.push_back("smoother.refine=" + call.refine);
  load_options(load_configuration(call.configurations, settings), material.options);
  material.stated = load_platform(call.platform);
  material.platform = material.stated;
  if (!call.magnetic.empty()) choose_magnetometers(material.options.magnetic.magnetometers, material.platform);
  if (!call.refine.empty() && std::none_of(call.estimators.begin(), call.estimators.end(), can_refine)) {
    throw InputError(
        "--refine: none of the estimators chosen can be refined; expected smoother or magnetic among them");
  }
  if (call.max_range_m) material.platform.suite.lidar.max_range_m = *call.max_range_m;
  if (!call.truth.empty()) material.truth = read_trajectory(call.truth);
  if (!call.calibration_truth.empty()) {
    material.true_calibration = read_true_calibration(call.calibration_truth, material.platform.suite);
  }
  if (!call.initial_pose_from.empty()) material.start = read_trajectory(call.initial_pose_from);
  material.sensors.lidar = !call.cloud.empty();
  material.sensors.magnetometers = !call.magnetic.empty();
  return material;
}

void load_maps(const RunCall& call, RunMaterial& material, WarningLog& warnings) {
  if (!call.cloud.empty()) {
    const LoadedPlanes loaded =
        load_planes(call.cloud, material.options.lidar.map, material.platform.suite.lidar, call.out, warnings);
    material.planes = loaded.source;
    std::printf("%s: %s\n", call.cloud.c_str(), loaded.description.c_str());
  } else {
    std::printf("no --cloud: LiDAR is left out, the run is magnetic-inertial\n");
  }
  if (!call.magnetic.empty()) {
    material.field =
        std::make_shared<MagneticMap>(read_magnetic_map(call.magnetic, material.options.magnetic.map.max_bytes()));
    if (material.platform.magnetometers.empty()) {
      throw InputError(
          fmt::format("{}: it has no magnetometers, which --magnetic is for; add them under 'magnetometers', or leave "
                      "--magnetic out",
                      material.platform.file_name()));
    }
    const FieldGrid& grid = material.field->grid();
    std::printf("%s: %d x %d nodes of %g m, %zu layer%s\n", call.magnetic.c_str(), grid.columns, grid.rows,
                grid.resolution_m, grid.heights_m.size(), grid.heights_m.size() == 1 ? "" : "s");
  } else {
    std::printf("no --magnetic: magnetometers are left out, the run is LiDAR-inertial\n");
  }
}

/// `lodestone check` in small, on the log's begin.
void check_begin(const RunCall& call, const RunMaterial& material, WarningLog& warnings) {
  if (call.check_seconds == 0.0) return;
  const auto start_at = [&](Time time) -> std::optional<Pose> {
    if (is_automatic(call) || (call.initial_pose.empty() && call.initial_pose_from.empty())) return std::nullopt;
    if (!call.initial_pose.empty()) return parse_initial_pose(call.initial_pose);
    return initial_pose_from(material.start, call.initial_pose_from, time);
  };
  check_first_seconds({call.log, material.platform, material.sensors, call.check_seconds, material.planes, start_at},
                      warnings);
}

/// A start that no map reaches can only fail: better said at once.
void check_start(const RunCall& call, const RunMaterial& material, const Pose& pose, Time time, WarningLog& warnings) {
  const Vector3& p = pose.position;
  if (material.planes != nullptr) {
    const double reach = material.platform.suite.lidar.max_range_m;
    const auto map = material.planes->around(p);
    const bool seen = std::any_of(map->planes().begin(), map->planes().end(), [&](const Plane& plane) {
      return (plane.center.cast<double>() - p).squaredNorm() < reach * reach;
    });
    if (!seen) {
      throw InputError(
          fmt::format("{}: no plane of this map within the LiDAR's {} m of the start ({:.2f} {:.2f} {:.2f}); "
                      "check --initial-pose and the map's frame",
                      call.cloud, reach, p.x(), p.y(), p.z()));
    }
  }
  if (material.field != nullptr && !material.field->query(p, FieldInterpolation::bilinear)) {
    warnings.add("run.start_off_field",
                 fmt::format("the start ({:.2f} {:.2f} {:.2f}) has no field in {}", p.x(), p.y(), p.z(), call.magnetic),
                 time);
  }
}

Pose find_start(const RunCall& call, const RunMaterial& material, Time time, WarningLog& warnings) {
  if (material.found) return material.found->T_map_imu;
  if (!call.initial_pose.empty()) return parse_initial_pose(call.initial_pose);
  if (!call.initial_pose_from.empty()) return initial_pose_from(material.start, call.initial_pose_from, time);
  warnings.add("run.initial_pose",
               "none given: the map's origin is taken; --initial-pose or --initial-pose-from says better", time);
  return {};
}

/// The bag and the synchronizer over it, alive as long as the function that reads them.
struct LogReader {
  LogReader(const RunCall& call, const RunMaterial& material, WarningLog& warnings)
      : source(call.log, material.platform, warnings, material.sensors),
        synchronizer(source, material.platform.suite, warnings, material.sensors) {}
  BagSource source;
  Synchronizer synchronizer;
};

OpenedLog open_log(const RunCall& call, const RunMaterial& material, WarningLog& warnings) {
  const auto reader = std::make_shared<LogReader>(call, material, warnings);
  return {reader->source.begin_time(), reader->source.end_time(),
          [reader](ScanBundle& bundle) { return reader->synchronizer.next(bundle); }};
}

/// Maps may take minutes to load: that the log cannot be read is said before.
void check_log(const RunCall& call, const RunMaterial& material) {
  WarningLog unheard;  // the estimators' own passes tell
  BagSource(call.log, material.platform, unheard, material.sensors);
}

struct LogSpan {
  Time begin = 0;
  Time end = 0;
};

/// Shows how far a refinement at the log's end has come; a signal ends it.
std::function<bool(double)> refining_progress(const std::string& name, const std::shared_ptr<const LogSpan>& log) {
  const auto progress = std::make_shared<std::unique_ptr<Progress>>();
  return [name, log, progress](double share) {
    if (*progress == nullptr) *progress = std::make_unique<Progress>(name + ", batch", log->begin, log->end);
    (*progress)->update(log->begin + static_cast<Time>(share * static_cast<double>(log->end - log->begin)));
    return !interrupt_requested();
  };
}

/// The bound where it was asked for.
std::optional<Bound> find_bound(const RunCall& call, const RunMaterial& material) {
  if (!call.bound) return std::nullopt;
  WarningLog unheard;  // the estimators' own passes tell
  const auto open = [&]() { return open_log(call, material, unheard); };
  const auto make = [&](const ScanBundle& first) {
    const Pose start = initial_pose_from(material.truth, call.truth, first.scan.start);
    return make_estimator("smoother", bound_input({material.platform.suite, material.planes, material.field, start,
                                                   Vector3::Zero(), material.options, &unheard, nullptr, nullptr},
                                                  material.truth));
  };
  return run_bound(open, make, material.truth, std::filesystem::path(call.out) / "bound.csv");
}

EstimatorOutcome run_one(const std::string& name, const RunCall& call, const RunMaterial& material, const Bound* bound,
                         WarningLog warnings) {
  EstimatorRun run;
  run.recording = recording_of(call, name);
  run.resume = call.resume;
  run.refines = material.options.smoother.refine == Refinement::batch;
  run.bound = bound;
  run.platform = &material.stated;
  run.log = call.log;
  run.name = name;
  run.folder = std::filesystem::path(call.out) / name;
  run.truth = call.truth.empty() ? nullptr : &material.truth;
  run.true_calibration = material.true_calibration ? &*material.true_calibration : nullptr;
  run.field = {material.field.get(), &material.platform.suite, &material.options};
  const auto span = std::make_shared<LogSpan>();
  run.open = [&]() {
    OpenedLog log = open_log(call, material, warnings);
    span->begin = log.begin;
    span->end = log.end;
    return log;
  };
  run.make_estimator = [&](const ScanBundle& first) {
    const Pose start = find_start(call, material, first.scan.start, warnings);
    check_start(call, material, start, first.scan.start, warnings);
    const Vector3 velocity = material.found ? material.found->velocity : Vector3::Zero();
    return make_estimator(name, {material.platform.suite, material.planes, material.field, start, velocity,
                                 material.options, &warnings, nullptr, refining_progress(name, span)});
  };
  return run_estimator(run, warnings);
}

/// Looks for the start once for all estimators.
void find_start_anywhere(const RunCall& call, RunMaterial& material, WarningLog& warnings) {
  WarningLog unheard;  // what is odd in these seconds is counted by the runs themselves
  const OpenedLog log = open_log(call, material, unheard);
  const EstimatorInput input{material.platform.suite, material.planes, material.field, {}, Vector3::Zero(),
                             material.options,        nullptr,         nullptr,        {}};
  material.found = find_automatic_start(call.log, input, log.next, warnings);
}

std::vector<std::pair<std::string, std::string>> inputs_of(const RunCall& call, const RunMaterial& material,
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
          {"initial_pose_found", material.found ? pose_text(material.found->T_map_imu) : ""},
          {"identity", digest(identity)}};
}

CallRecord record_of(const RunCall& call, const RunMaterial& material) {
  CallRecord record{call, std::nullopt, material.options.smoother.refine == Refinement::batch};
  if (!call.cloud.empty()) record.max_range_m = material.platform.suite.lidar.max_range_m;
  return record;
}

int exit_code_of(const std::vector<RunSummary>& runs) {
  int code = exit_code::done;
  for (const RunSummary& run : runs) {
    if (run.status == RunStatus::interrupted) return exit_code::interrupted;
    if (run.status == RunStatus::lost) code = exit_code::track_lost;
  }
  return code;
}

/// Keeps what a report needs of log and maps.
void keep_overview(const RunCall& call, const RunMaterial& material, Time log_begin,
                   const std::vector<PictureSeries>& series) {
  OverviewInput input{log_begin, call.truth.empty() ? nullptr : &material.truth, material.field.get(), call.cloud, {}};
  for (const PictureSeries& one : series) input.estimates.push_back(&one.trajectory);
  write_overview(std::filesystem::path(call.out) / "overview", input);
  std::printf("for one page of it all: lodestone report %s\n", call.out.c_str());
}

}  // namespace

int execute(const RunCall& call) {
  catch_interrupts();
  check_call(call);
  const ThreadLimit limit(call.threads.value_or(0));
  WarningLog shared;
  RunMaterial material = load_small_files(call);
  check_log(call, material);
  load_maps(call, material, shared);
  check_begin(call, material, shared);
  const std::filesystem::path out = made_folder(call.out);
  const RunIdentity identity = identify(call, material.options);
  if (const auto code = begin_or_resume(call, identity)) return *code;
  write_text_file(
      (out / "config.yaml").string(),
      "# Every option of this run; --config takes it again. What else the call said is in summary.json: call.\n" +
          save_options(material.options));
  StaleResults stale(out, estimator_names());

  if (is_automatic(call)) find_start_anywhere(call, material, shared);
  const std::optional<Bound> bound = find_bound(call, material);
  std::vector<RunSummary> summaries;
  std::vector<PictureSeries> series;
  std::vector<EstimatorOutcome> outcomes;
  Time log_begin = 0;
  for (const std::string& name : call.estimators) {
    EstimatorOutcome outcome = run_one(name, call, material, bound ? &*bound : nullptr, shared);
    series.push_back(picture_series(outcome));
    log_begin = outcome.log_begin;
    if (outcome.replayed) stale.keep_calibration(out / name);
    summaries.push_back(outcome.summary);
    outcomes.push_back(std::move(outcome));
    write_text_file((out / "summary.json").string(),
                    to_json(inputs_of(call, material, identity), record_of(call, material), summaries, bound));
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
  if (material.field != nullptr) write_stale_map_pictures(out / "pictures", *material.field, outcomes);
  if (!call.truth.empty()) {
    write_pictures(out / "pictures", material.field.get(), material.truth, series);
  }
  if (material.field != nullptr || !call.truth.empty()) std::printf("pictures: %s\n", (out / "pictures").c_str());
  keep_overview(call, material, log_begin, series);
  const int code = exit_code_of(summaries);
  if (code != exit_code::interrupted) {
    stale.remove();
    remove_recordings(call);
  }
  return code;
}

}  // namespace lodestone

#include "tools/check/check_call.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>

#include "core/thread_limit.h"
#include "frontends/configuration/missing_file.h"
#include "frontends/configuration/trajectory_file.h"
#include "frontends/maps/magnetic_map_file.h"
#include "frontends/maps/plane_map_loader.h"
#include "frontends/synchronizer/bag_source.h"
#include "localization/initial_pose.h"
#include "tools/check/check_drive.h"
#include "tools/check/check_report.h"
#include "tools/check/initial_pose_checks.h"
#include "tools/check/log_checks.h"
#include "tools/check/map_checks.h"
#include "tools/commands.h"
#include "tools/writers/output_folder.h"

namespace lodestone {

namespace {

constexpr std::size_t kFewestScans = 3;

void check_call(const CheckCall& call) {
  if (!(call.seconds > 0.0))
    throw InputError(fmt::format("--seconds: expected a number above 0, found {}", call.seconds));
  if (!std::filesystem::exists(call.log)) throw missing_file(call.log, "log");
  const bool maps = !call.cloud.empty() || !call.magnetic.empty();
  if (maps && call.platform.empty()) throw InputError("--cloud, --magnetic: a map requires --platform; add it");
  if (!call.initial_pose.empty() && call.initial_pose != "auto") parse_initial_pose(call.initial_pose);
  if (call.initial_pose == "auto" && call.cloud.empty())
    throw InputError("--initial-pose auto: requires --cloud; add it");
  if (call.out.empty()) return;
  refuse_folder(call.out);
  check_folder(std::filesystem::absolute(call.out).parent_path());
}

/// The sensors that a run with these maps reads. Without maps: all sensors of the platform file.
SensorChoice needed_sensors(const CheckCall& call, const Platform& platform) {
  const bool all = call.cloud.empty() && call.magnetic.empty();
  return {.lidar = !call.cloud.empty() || (all && platform.has_lidar()),
          .magnetometers = all || !call.magnetic.empty()};
}

/// Errors of a run's preparation that no check has reported.
bool run_would_start(const CheckCall& call, const Platform& platform, Findings& findings) {
  try {
    WarningLog unheard;
    const BagSource source(call.log, platform, unheard, needed_sensors(call, platform));
  } catch (const InputError& error) {
    if (!has_error(findings)) findings.push_back(error_finding("run.refuses", error));
    return false;
  }
  return true;
}

/// `poses`: the trajectory of --initial-pose-from.
std::optional<Pose> given_initial_pose(const CheckCall& call, const Trajectory& poses, Time time) {
  if (!call.initial_pose_from.empty()) return initial_pose_from(poses, call.initial_pose_from, time);
  if (!call.initial_pose.empty() && call.initial_pose != "auto")
    return parse_initial_pose(call.initial_pose, call.origin_m);
  return std::nullopt;
}

void check_on_maps(const CheckCall& call, const Trajectory& poses, const Platform& platform,
                   const ScanOdometry& odometry, CheckResult& result) {
  Findings& findings = result.findings;
  const MapFiles maps{call.cloud, call.magnetic, call.origin_m};
  const SensorChoice sensors = sensors_for(maps);
  CheckDrive drive{call.log, {platform, {}, maps, sensors}, call.seconds};
  Site& site = drive.site;
  if (!call.cloud.empty()) {
    const LoadedPlanes loaded =
        load_planes(call.cloud, site.options.lidar.map, platform.suite.lidars(),
                    std::filesystem::temp_directory_path().string(), site.warnings, call.origin_m);
    site.planes = loaded.source;
    const Findings of_map = check_map(*loaded.source, site.options.lidar.map, loaded.points);
    append(findings, of_map);
    if (has_error(of_map)) return;
  }
  if (!call.magnetic.empty()) {
    site.field = std::make_shared<MagneticMap>(
        read_magnetic_map(call.magnetic, site.options.magnetic.map.max_bytes(), call.origin_m));
  }
  const bool scans = result.sample.scans().size() >= kFewestScans;
  if (result.sample.imu.empty() || (site.planes != nullptr && !scans)) return;
  const Time begin = scans ? result.sample.scans().front().start : result.sample.imu.front().time;
  std::optional<Pose> start = given_initial_pose(call, poses, begin);
  if (call.initial_pose == "auto") start = drive.find_start(findings);
  if (!start) {
    if (call.initial_pose.empty()) {
      findings.push_back({Severity::note, "start.not_given",
                          "there is no initial pose: nothing is compared with the maps",
                          "set --initial-pose or --initial-pose-from, or use --initial-pose auto"});
    }
    return;
  }
  if (site.planes != nullptr && !odometry.poses.empty()) {
    // The trajectory has the pose of the first scan. A given pose is that of a robot at rest.
    const Pose at_scan =
        call.initial_pose_from.empty() ? *start : *given_initial_pose(call, poses, odometry.poses.front().time);
    append(findings, check_initial_pose({result.sample, platform, odometry, *site.planes, at_scan,
                                         [&]() { return drive.find_anywhere(); }, call.origin_m}));
  }
  if (has_error(findings) || has(findings, "clock.lidar_imu", Severity::warning) ||
      has(findings, "start.off", Severity::warning) || has(findings, "extrinsic.inverse", Severity::warning)) {
    findings.push_back({Severity::note, "drive.left_out",
                        "the drive is not compared with the maps because of the findings "
                        "above",
                        "correct these findings and check again"});
    return;
  }
  append(findings, drive.check(*start, result.sample, findings));
}

}  // namespace

CheckResult check_log(const CheckCall& call) {
  check_call(call);
  CheckResult result;
  WarningLog warnings;
  Platform platform;
  if (call.platform.empty()) {
    platform.imu.topic = platform.lidar.topic = "";
  } else {
    platform = load_platform(call.platform, {.lidar = !call.cloud.empty()});
  }
  // Read even without maps, so that a wrong file name is an error.
  const Trajectory poses =
      call.initial_pose_from.empty() ? Trajectory{} : read_site_trajectory(call.initial_pose_from, call.origin_m);
  result.sample = read_log_sample(call.log, platform, call.seconds, warnings);
  for (const auto& [kind, entry] : warnings.entries()) {
    result.findings.push_back({Severity::warning, kind, fmt::format("{} ({} x)", entry.first_detail, entry.count), ""});
  }
  if (std::none_of(result.sample.topics.begin(), result.sample.topics.end(),
                   [](const TopicInfo& topic) { return topic.messages > 0; })) {
    result.findings.push_back({Severity::error, "log.empty", "the log has no messages", "record again"});
    return result;
  }
  if (call.platform.empty()) {
    result.findings.push_back({Severity::note, "platform.none",
                               "there is no platform file: topics are listed, but not checked",
                               "set --platform; `lodestone init` writes one from this log"});
    return result;
  }
  const std::vector<ScanOdometry> odometry = follow_all_scans(result.sample, platform);
  append(result.findings, check_sensors(result.sample, platform, needed_sensors(call, platform)));
  check_motion(result.sample, platform, odometry, result.findings);
  if (call.cloud.empty()) append(result.findings, check_floor(result.sample, platform, odometry.front()));
  const bool maps = !call.cloud.empty() || !call.magnetic.empty();
  if (run_would_start(call, platform, result.findings) && maps) {
    check_on_maps(call, poses, platform, odometry.front(), result);
  }
  for (Finding& one : result.findings) {
    const std::string prefix = call.log + ": ";
    if (one.seen.rfind(prefix, 0) == 0) one.seen.erase(0, prefix.size());
  }
  std::stable_sort(result.findings.begin(), result.findings.end(),
                   [](const Finding& a, const Finding& b) { return a.severity < b.severity; });
  return result;
}

int execute(const CheckCall& call) {
  const ThreadLimit limit(call.threads.value_or(0));
  const CheckResult result = check_log(call);
  std::fputs(check_text(result).c_str(), stdout);
  if (!call.out.empty()) {
    make_folder_of(call.out);
    write_check_json(call.out, result);
  }
  const auto errors = std::count_if(result.findings.begin(), result.findings.end(),
                                    [](const Finding& one) { return one.severity == Severity::error; });
  if (errors == 0) return exit_code::done;
  std::fflush(stdout);
  spdlog::error("lodestone: {}: {}", call.log, summary_of(result.findings));
  return exit_code::input_error;
}

}  // namespace lodestone

#include "tools/run/first_seconds.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>

#include "core/error.h"
#include "frontends/synchronizer/bag_source.h"
#include "tools/check/initial_pose_checks.h"
#include "tools/check/log_checks.h"

namespace lodestone {

namespace {

/// Errors that do not refuse a run: the run discards, down-weights or bridges the data, corrects the initial pose, or a
/// few seconds of motion are less reliable than the map.
constexpr std::array<std::string_view, 10> kSurvived{
    "imu.stamp_zero",     "lidar.stamp_zero",       "magnetometer.stamp_zero", "magnetometer.zero",
    "extrinsic.rotation", "extrinsic.heading",      "start.no_overlap",        "start.tilt",
    "start.wrong",        "magnetometer.same_place"};

/// Kinds that reader, synchronizer and estimators count along the whole log.
constexpr std::array<std::string_view, 11> kCounted{"imu.stamp_order",
                                                    "lidar.stamp_order",
                                                    "magnetometer.stamp_order",
                                                    "imu.not_finite",
                                                    "magnetometer.not_finite",
                                                    "imu.gap",
                                                    "lidar.outage",
                                                    "lidar.empty",
                                                    "magnetometer.stuck",
                                                    "magnetometer.limit",
                                                    "magnetometer.spike"};

template <class Kinds>
bool is_among(const Kinds& kinds, const std::string& kind) {
  return std::find(kinds.begin(), kinds.end(), kind) != kinds.end();
}

bool refuses_run(const Finding& finding, const LogSample& sample) {
  if (finding.severity != Severity::error || is_among(kSurvived, finding.kind)) return false;
  // Equal times of all points are valid for a robot at rest and for deskewed scans.
  if (finding.kind == "lidar.point_time") {
    return std::any_of(sample.lidars.begin(), sample.lidars.end(),
                       [](const LidarSample& lidar) { return lidar.refused_cloud.has_value(); });
  }
  return true;
}

std::string strip_path(const std::string& text, const std::string& log) {
  const std::string prefix = log + ": ";
  return text.rfind(prefix, 0) == 0 ? text.substr(prefix.size()) : text;
}

std::string line_of(const Finding& finding, const std::string& log) {
  return strip_path(finding.seen, log) + (finding.change.empty() ? "" : "; " + finding.change);
}

Findings run_checks(const FirstSeconds& run, const LogSample& sample) {
  Findings findings = check_sensors(sample, run.platform, run.sensors);
  if (has_error(findings) || !run.sensors.lidar || sample.imu.empty() || sample.scans().empty()) return findings;
  const std::vector<ScanOdometry> odometry = follow_all_scans(sample, run.platform);
  check_motion(sample, run.platform, odometry, findings);
  std::optional<Pose> start;
  try {
    if (!odometry.front().poses.empty()) start = run.start_at(odometry.front().poses.front().time);
  } catch (const InputError&) {
    // The run itself reports the error of the initial pose.
  }
  if (start && run.planes != nullptr && !has_error(findings)) {
    append(findings,
           check_initial_pose({sample, run.platform, odometry.front(), *run.planes, *start, nullptr, run.origin_m}));
  }
  return findings;
}

}  // namespace

void check_first_seconds(const FirstSeconds& run, WarningLog& warnings) {
  WarningLog ignored;  // the run reports these warnings itself
  const LogSample sample = read_log_sample(run.log, run.platform, run.seconds, ignored, run.sensors);
  const Findings findings = run_checks(run, sample);
  for (const Finding& finding : findings) {
    if (!refuses_run(finding, sample)) continue;
    BagSource(run.log, run.platform, ignored, run.sensors);  // the reader's own error is more specific
    throw InputError(fmt::format("{}: {}: {}; --check-seconds 0 skips this check", run.log, finding.kind,
                                 line_of(finding, run.log)));
  }
  for (const Finding& finding : findings) {
    if (finding.severity == Severity::note || is_among(kCounted, finding.kind)) continue;
    warnings.add("check." + finding.kind, line_of(finding, run.log), finding.time.value_or(sample.begin));
  }
}

}  // namespace lodestone

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

/// Errors that a run may survive all the same: it drops, weighs down or bridges what they tell of, a start that is off
/// is drawn in, and a few seconds of motion say less of a direction than a map does.
constexpr std::array<std::string_view, 9> kSurvived{
    "imu.stamp_zero",    "lidar.stamp_zero",   "magnetometer.stamp_zero",
    "magnetometer.zero", "extrinsic.rotation", "extrinsic.heading",
    "start.no_overlap",  "start.tilt",         "start.wrong"};

/// What the reader, the synchronizer and the estimators count themselves, along the whole log.
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

bool ends_a_run(const Finding& finding, const LogSample& sample) {
  if (finding.severity != Severity::error || is_among(kSurvived, finding.kind)) return false;
  // Points that all have one time are no fault of a robot that stands, or of a driver that takes the motion out itself.
  if (finding.kind == "lidar.point_time") {
    return std::any_of(sample.lidars.begin(), sample.lidars.end(),
                       [](const LidarSample& lidar) { return lidar.refused_cloud.has_value(); });
  }
  return true;
}

std::string without_path(const std::string& text, const std::string& log) {
  const std::string prefix = log + ": ";
  return text.rfind(prefix, 0) == 0 ? text.substr(prefix.size()) : text;
}

std::string line_of(const Finding& finding, const std::string& log) {
  return without_path(finding.seen, log) + (finding.change.empty() ? "" : "; " + finding.change);
}

Findings look(const FirstSeconds& run, const LogSample& sample) {
  Findings findings = check_sensors(sample, run.platform, run.sensors);
  if (has_error(findings) || !run.sensors.lidar || sample.imu.empty() || sample.scans().empty()) return findings;
  const std::vector<ScanOdometry> odometry = follow_all_scans(sample, run.platform);
  check_motion(sample, run.platform, odometry, findings);
  std::optional<Pose> start;
  try {
    if (!odometry.front().poses.empty()) start = run.start_at(odometry.front().poses.front().time);
  } catch (const InputError&) {
    // The run says it where it needs the start.
  }
  if (start && run.planes != nullptr && !has_error(findings)) {
    append(findings, check_initial_pose({sample, run.platform, odometry.front(), *run.planes, *start, nullptr}));
  }
  return findings;
}

}  // namespace

void check_first_seconds(const FirstSeconds& run, WarningLog& warnings) {
  WarningLog unheard;  // the run's own reading says it again
  const LogSample sample = read_log_sample(run.log, run.platform, run.seconds, unheard, run.sensors);
  const Findings findings = look(run, sample);
  for (const Finding& finding : findings) {
    if (!ends_a_run(finding, sample)) continue;
    BagSource(run.log, run.platform, unheard, run.sensors);  // what the reader refuses it says better
    throw InputError(fmt::format("{}: {}: {}; --check-seconds 0 runs all the same", run.log, finding.kind,
                                 line_of(finding, run.log)));
  }
  for (const Finding& finding : findings) {
    if (finding.severity == Severity::note || is_among(kCounted, finding.kind)) continue;
    warnings.add("check." + finding.kind, line_of(finding, run.log), finding.time.value_or(sample.begin));
  }
}

}  // namespace lodestone

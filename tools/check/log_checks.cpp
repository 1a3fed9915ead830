#include "tools/check/log_checks.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/nearest_name.h"
#include "frontends/configuration/platform_lidars.h"
#include "tools/check/acceleration_checks.h"
#include "tools/check/imu_checks.h"
#include "tools/check/rotation_checks.h"
#include "tools/check/sensor_checks.h"

namespace lodestone {
namespace {

constexpr double same_place_m = 1e-3;  // two chips on one board are farther apart

bool is_guess(const Platform& platform, std::size_t magnetometer) {
  const std::string key = fmt::format("magnetometers[{}].T_imu_mag", magnetometer);
  return std::find(platform.guesses.begin(), platform.guesses.end(), key) != platform.guesses.end();
}

/// What the platform file states about mountings: values that nobody measured, and two magnetometers at one place. A
/// log alone shows no wrong lever arm.
Findings check_mountings(const Platform& platform, SensorChoice needed) {
  Findings findings;
  if (!platform.guesses.empty()) {
    findings.push_back({Severity::warning, "platform.guesses",
                        fmt::format("{}: nobody measured {}: a run may be off by the error of these values, and no "
                                    "check finds it",
                                    platform.file_name(), join_names(platform.guesses)),
                        "measure and correct them, then remove them from guesses"});
  }
  const std::vector<MagnetometerModel>& magnetometers = platform.suite.magnetometers;
  for (std::size_t i = 0; needed.magnetometers && i < magnetometers.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const Vector3 apart = magnetometers[i].T_imu_mag.position - magnetometers[j].T_imu_mag.position;
      if (apart.norm() >= same_place_m || is_guess(platform, i) || is_guess(platform, j)) continue;
      findings.push_back({Severity::error, "magnetometer.same_place",
                          fmt::format("{} and {} have the same position in {}", magnetometers[j].name,
                                      magnetometers[i].name, platform.file_name()),
                          fmt::format("measure magnetometers[{}].T_imu_mag, or remove a magnetometer that is listed "
                                      "twice",
                                      i),
                          std::nullopt, i});
      return findings;  // one line for an array without any position
    }
  }
  return findings;
}

}  // namespace

Findings check_sensors(const LogSample& sample, const Platform& platform, SensorChoice needed) {
  Findings findings = check_topics(sample, platform, needed);
  append(findings, check_stamps(sample, platform));
  append(findings, check_scans(sample, platform));
  append(findings, check_imu(sample, platform));
  append(findings, check_magnetometers(sample, platform));
  append(findings, check_wheels(sample, platform));
  append(findings, check_mountings(platform, needed));
  return findings;
}

std::vector<ScanOdometry> follow_all_scans(const LogSample& sample, const Platform& platform) {
  std::vector<ScanOdometry> all;
  for (std::size_t i = 0; i < sample.lidars.size(); ++i) {
    all.push_back(follow_scans(sample.lidars[i].scans, model_of(platform, i)));
  }
  return all;
}

void check_motion(const LogSample& sample, const Platform& platform, const std::vector<ScanOdometry>& odometry,
                  Findings& findings) {
  if (!platform.has_lidar()) return;
  for (std::size_t i = 0; i < odometry.size(); ++i) {
    const Trajectory& poses = odometry[i].poses;
    const auto rotation = fit_rotation(poses, sample.imu, model_of(platform, i).T_imu_lidar.rotation);
    if (odometry[i].lost) {
      findings.push_back(
          {Severity::note, "lidar.motion",
           fmt::format("{}: scan odometry ends after {:.1f} s: the scans have too few planes or the motion is too fast",
                       layout_of(platform, i).topic, to_seconds(poses.back().time - poses.front().time)),
           "", poses.back().time});
    }
    const Findings turns = check_rotation(rotation, platform, i);
    append(findings, turns);
    // A clock offset also changes accelerations. If turns determine the heading, they are more accurate.
    if (has(turns, "clock.lidar_imu", Severity::warning) || has_error(findings) ||
        (rotation && rotation->turn_observable()))
      continue;
    const Findings heading = check_heading(poses, sample, platform, i);
    // A wrong heading of T_imu_lidar looks like a step of the gyroscope's bias.
    if (!heading.empty()) std::erase_if(findings, [](const Finding& one) { return one.kind == "imu.gyroscope_step"; });
    append(findings, heading);
  }
}

}  // namespace lodestone

#include "tools/check/rotation_checks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/angles.h"
#include "frontends/configuration/platform_lidars.h"

namespace lodestone {
namespace {

constexpr double significant_offset_s = 0.015;
constexpr double better_by = 1.5;  // smallest ratio of unexplained variances without and with the offset
constexpr double scale_tolerance = 0.05;
constexpr double axis_tolerance_rad = 0.07;  // 4°: limit due to odometry drift
constexpr double least_turn_rad = 0.17;      // 10°: correlated noise exceeds the sigma
constexpr double turn_sigmas = 8.0;
constexpr double better_inverse = 0.5;
constexpr double steady_rad_s = 0.03;  // rms turn rate about its mean, for a robot at rest or on a straight path
constexpr double rotation_step_sigmas = 8.0;
constexpr double significant_step_rad_s = 0.01;

double share_of_scan(ScanStamp stamp) {
  return stamp == ScanStamp::start ? 0.0 : stamp == ScanStamp::middle ? 0.5 : 1.0;
}

/// The finding about the clocks of the IMU and one LiDAR.
Finding clock_finding(const RotationFit& fit, const Platform& platform, std::size_t lidar) {
  const std::string name = lidar == 0 ? "the LiDAR" : lidar_key(lidar);
  const double unexplained = 1.0 - fit.correlation * fit.correlation;
  const double unexplained_unshifted = 1.0 - fit.correlation_unshifted * fit.correlation_unshifted;
  if (std::abs(fit.offset_s) <= significant_offset_s || unexplained_unshifted <= better_by * unexplained) {
    return {
        Severity::note, "clock.lidar_imu",
        fmt::format("{} and the IMU turn together (correlation {:.3f}), the IMU's stamps {:+.3f} s from the LiDAR's",
                    name, fit.correlation, fit.offset_s),
        ""};
  }
  const double period_s = model_of(platform, lidar).scan_period_s;
  const LidarMessageLayout& layout = layout_of(platform, lidar);
  std::string change = fmt::format("use one clock for both, or set {}.clock_offset_s: {:.3f} in the platform file",
                                   lidar_key(lidar), layout.clock_offset_s - fit.offset_s);
  // The position of the stamp within the scan for which the clocks agree. A deskewed scan has a single instant.
  const double stamped = share_of_scan(layout.stamp.value_or(ScanStamp::start)) - fit.offset_s / period_s;
  for (const auto& [stamp, name_of_stamp] : enum_names(ScanStamp::start)) {
    if (layout.point_times == PointTimes::none || stamp == layout.stamp ||
        std::abs(stamped - share_of_scan(stamp)) > 0.2)
      continue;
    change = fmt::format("{}.stamp: {}; else ", lidar_key(lidar), name_of_stamp) + change;
  }
  return {Severity::warning, "clock.lidar_imu",
          fmt::format("the IMU's stamps are {:.3f} s {} than those of {}: the correlation of turns is {:.3f} with this "
                      "offset and {:.3f} "
                      "without",
                      std::abs(fit.offset_s), fit.offset_s > 0.0 ? "later" : "earlier", name, fit.correlation,
                      fit.correlation_unshifted),
          change};
}

Findings check_scale(const RotationFit& fit, const Platform& platform) {
  if (fit.scale_least <= 1.0 + scale_tolerance && fit.scale_most >= 1.0 - scale_tolerance) return {};
  const bool in_degrees = std::abs(fit.scale / degrees_per_radian - 1.0) < 0.2;
  return {{in_degrees ? Severity::error : Severity::warning, "imu.gyroscope_unit",
           fmt::format("{}: the gyroscope's turns are {:.3f} times those of the LiDAR{}", platform.imu.topic, fit.scale,
                       in_degrees ? ": degrees per second" : ""),
           "an Imu message requires rad/s: convert or calibrate before recording"}};
}

/// The estimated rotation, as a line for the platform file.
std::string rotation_line(const RotationFit& fit) {
  const Quaternion q = fit.R_imu_lidar.w() < 0.0 ? Quaternion(-fit.R_imu_lidar.coeffs()) : fit.R_imu_lidar;
  return fmt::format("quaternion_xyzw: [{:.3f}, {:.3f}, {:.3f}, {:.3f}] to some degrees", q.x(), q.y(), q.z(), q.w());
}

Findings check_axis(const RotationFit& fit, const Platform& platform, std::size_t lidar) {
  const std::string name = lidar == 0 ? "LiDAR" : lidar_key(lidar);
  const double turn_tolerance_rad = std::max(least_turn_rad, turn_sigmas * fit.turn_sigma_rad);
  const bool turned =
      fit.turn_observable() && std::abs(fit.turn_about_axis_rad) > std::max(turn_tolerance_rad, fit.axis_error_rad);
  // Near the identity, a mounting hardly differs from its inverse. The inverse must fit much better, for it stops a
  // run.
  const bool inverse_fits_turn =
      !fit.turn_observable() || std::abs(fit.turn_about_axis_inverse_rad) <= turn_tolerance_rad ||
      std::abs(fit.turn_about_axis_inverse_rad) < better_inverse * std::abs(fit.turn_about_axis_rad);
  const double given_rad = turned ? std::abs(fit.turn_about_axis_rad) : fit.axis_error_rad;
  const double inverse_rad = turned ? std::abs(fit.turn_about_axis_inverse_rad) : fit.axis_error_inverse_rad;
  const bool inverse =
      fit.axis_error_inverse_rad < axis_tolerance_rad && inverse_fits_turn && inverse_rad < better_inverse * given_rad;
  std::string change = fmt::format("{} {}.T_imu_lidar in {}",
                                   inverse  ? "invert"
                                   : turned ? "turn"
                                            : "correct",
                                   lidar_key(lidar), platform.file_name());
  if (!inverse && fit.turn_observable()) change += ": " + rotation_line(fit);
  if (fit.axis_error_rad > axis_tolerance_rad && !turned) {
    return {
        {Severity::error, inverse ? "extrinsic.inverse" : "extrinsic.rotation",
         fmt::format("the robot's turning axis differs by {:.1f} deg between IMU and {}; with "
                     "the inverse of T_imu_lidar by {:.1f} deg",
                     fit.axis_error_rad * degrees_per_radian, name, fit.axis_error_inverse_rad * degrees_per_radian),
         change}};
  }
  if (!turned) return {};
  return {{Severity::error, inverse ? "extrinsic.inverse" : "extrinsic.heading",
           fmt::format("{} is rotated by {:.0f} deg about the robot's turning axis relative to T_imu_lidar, from "
                       "the small turns "
                       "about the other axes (sigma {:.1f} deg); by {:.0f} deg relative to its inverse",
                       lidar == 0 ? "the LiDAR" : name, given_rad * degrees_per_radian,
                       fit.turn_sigma_rad * degrees_per_radian, inverse_rad * degrees_per_radian),
           change}};
}

Findings check_step(const RotationFit& fit, const Platform& platform) {
  if (fit.bias_step_rad_s <= std::max(significant_step_rad_s, rotation_step_sigmas * fit.bias_step_sigma_rad_s))
    return {};
  if (fit.axis_observable() && fit.axis_error_rad >= axis_tolerance_rad) return {};
  // Without correlation there is no evidence of a bias: on open ground, the odometry's heading drifts.
  if (!fit.axis_observable() && fit.excitation_rad_s > steady_rad_s) return {};
  return {{Severity::warning, "imu.gyroscope_step",
           fmt::format("{}: the gyroscope's bias steps by {:.4f} rad/s relative to the LiDAR's turns",
                       platform.imu.topic, fit.bias_step_rad_s),
           "check the IMU (shocks, temperature, power)", fit.bias_step_time}};
}

std::string reason_unobservable(const std::optional<RotationFit>& fit) {
  if (!fit) return "too few scans with odometry and IMU samples to compare their turns";
  const char* unobservable = "the clocks of LiDAR and IMU and the rotation of T_imu_lidar are not observable";
  if (fit->excitation_rad_s <= RotationFit::least_excitation_rad_s) {
    return fmt::format("the robot turns too little ({:.3f} rad/s rms about the mean): {}", fit->excitation_rad_s,
                       unobservable);
  }
  if (fit->correlation > RotationFit::least_correlation) {
    return fmt::format("{} scans with turns of {:.3f} rad/s rms determine the turning axis to {:.1f} deg only: {}",
                       fit->intervals, fit->excitation_rad_s, fit->axis_sigma_rad() * degrees_per_radian, unobservable);
  }
  return fmt::format(
      "the turns of LiDAR ({:.3f} rad/s rms about the mean) and IMU have a low correlation ({:.2f} over {} "
      "scans): {}",
      fit->excitation_rad_s, fit->correlation, fit->intervals, unobservable);
}

}  // namespace

Findings check_rotation(const std::optional<RotationFit>& fit, const Platform& platform, std::size_t lidar) {
  Findings findings;
  if (!fit || !fit->axis_observable()) {
    findings.push_back({Severity::note, "clock.unobservable", reason_unobservable(fit),
                        fit ? "increase --seconds; use a part of the log with turns" : ""});
  } else {
    findings.push_back(clock_finding(*fit, platform, lidar));
    if (lidar == 0) append(findings, check_scale(*fit, platform));
    append(findings, check_axis(*fit, platform, lidar));
  }
  if (fit && lidar == 0) append(findings, check_step(*fit, platform));
  return findings;
}

}  // namespace lodestone

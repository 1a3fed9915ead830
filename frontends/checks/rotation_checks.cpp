#include "frontends/checks/rotation_checks.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "core/angles.h"
#include "core/evaluation/statistics.h"
#include "frontends/checks/step_search.h"
#include "frontends/checks/turn_integral.h"
#include "frontends/readers/platform_lidars.h"

namespace lodestone {
namespace {

constexpr double largest_offset_s = 5.0;
constexpr double coarse_step_s = 0.02;
constexpr double fine_step_s = 0.002;
constexpr double least_overlap = 0.6;  // of the intervals: a few that happen to agree are no evidence
constexpr std::size_t fewest_turns = 20;
constexpr double telling_offset_s = 0.015;
constexpr double better_by = 1.5;  // times less unexplained variance at the offset than without
constexpr double scale_tolerance = 0.05;
constexpr double axis_tolerance_rad = 0.07;  // 4°: what a drifting odometry may be wrong by
constexpr double rotation_step_sigmas = 8.0;
constexpr double telling_step_rad_s = 0.01;
constexpr std::size_t least_rotation_side = 5;

struct Turn {
  Time begin;
  Time end;
  Vector3 rate;  // rad/s, lidar frame
};

struct Pair {
  Vector3 gyroscope;
  Vector3 lidar;
  Time time;
};

std::vector<Pair> pairs_at(const std::vector<Turn>& turns, const TurnIntegral& gyroscope, double offset_s) {
  const Time shift = from_seconds(offset_s);
  std::vector<Pair> pairs;
  for (const Turn& turn : turns) {
    const auto turned = gyroscope.over(turn.begin + shift, turn.end + shift);
    if (turned) pairs.push_back({*turned / to_seconds(turn.end - turn.begin), turn.rate, turn.end});
  }
  return pairs;
}

struct Moments {
  Matrix3 cross = Matrix3::Zero();  // Σ (gyroscope − mean)(lidar − mean)ᵀ
  Matrix3 lidar = Matrix3::Zero();
  double gyroscope = 0.0;
};

Moments moments_of(const std::vector<Pair>& pairs) {
  Vector3 gyroscope = Vector3::Zero();
  Vector3 lidar = Vector3::Zero();
  for (const Pair& pair : pairs) {
    gyroscope += pair.gyroscope / static_cast<double>(pairs.size());
    lidar += pair.lidar / static_cast<double>(pairs.size());
  }
  Moments result;
  for (const Pair& pair : pairs) {
    result.cross += (pair.gyroscope - gyroscope) * (pair.lidar - lidar).transpose();
    result.lidar += (pair.lidar - lidar) * (pair.lidar - lidar).transpose();
    result.gyroscope += (pair.gyroscope - gyroscope).squaredNorm();
  }
  return result;
}

/// After the best rotation between the frames (Kabsch): the sum of the cross moments' singular values.
double correlation_at(const std::vector<Turn>& turns, const TurnIntegral& gyroscope, double offset_s) {
  const std::vector<Pair> pairs = pairs_at(turns, gyroscope, offset_s);
  if (static_cast<double>(pairs.size()) < least_overlap * static_cast<double>(turns.size())) return 0.0;
  const Moments moments = moments_of(pairs);
  const double size = std::sqrt(moments.gyroscope * moments.lidar.trace());
  if (!(size > 0.0)) return 0.0;
  const Eigen::JacobiSVD<Matrix3> svd(moments.cross);
  const double sign = moments.cross.determinant() < 0.0 ? -1.0 : 1.0;
  const Vector3& values = svd.singularValues();
  return (values[0] + values[1] + sign * values[2]) / size;
}

double best_offset(const std::vector<Turn>& turns, const TurnIntegral& gyroscope) {
  double best_s = 0.0;
  double best = correlation_at(turns, gyroscope, 0.0);
  const auto look = [&](double from_s, double until_s, double step_s) {
    for (double offset_s = from_s; offset_s <= until_s + 1e-9; offset_s += step_s) {
      const double found = correlation_at(turns, gyroscope, offset_s);
      if (found > best) {
        best = found;
        best_s = offset_s;
      }
    }
  };
  look(-largest_offset_s, largest_offset_s, coarse_step_s);
  look(best_s - coarse_step_s, best_s + coarse_step_s, fine_step_s);
  return best_s;
}

double angle_between(const Vector3& a, const Vector3& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

/// The one axis that a robot on a floor turns about, as both see it.
/// Returns `R_imu_lidar` turned by as little as brings the two together.
Quaternion compare_axes(const Moments& moments, const Quaternion& R_imu_lidar, RotationFit& fit) {
  const Eigen::SelfAdjointEigenSolver<Matrix3> solver(moments.lidar);
  const Vector3 axis = solver.eigenvectors().col(2);
  const Vector3 seen = moments.cross * axis;
  fit.scale = seen.norm() / solver.eigenvalues()[2];
  fit.axis_error_rad = angle_between(R_imu_lidar * axis, seen);
  fit.axis_error_inverse_rad = angle_between(R_imu_lidar.conjugate() * axis, seen);
  return Quaternion::FromTwoVectors(R_imu_lidar * axis, seen) * R_imu_lidar;
}

void find_step(const std::vector<Pair>& pairs, const Quaternion& R_imu_lidar, double scale, RotationFit& fit) {
  std::vector<Vector3> differences;
  for (const Pair& pair : pairs) differences.push_back(pair.gyroscope / scale - R_imu_lidar * pair.lidar);
  const LargestStep step = largest_step(differences, least_rotation_side);
  if (step.index == 0) return;
  // A few turns that the odometry got wrong move a mean; a bias moves the median as much.
  const auto middle = [&](std::size_t begin, std::size_t end) {
    Vector3 result;
    for (int axis = 0; axis < 3; ++axis) {
      std::vector<double> values;
      for (std::size_t i = begin; i < end; ++i) values.push_back(differences[i][axis]);
      result[axis] = summarize(values).median;
    }
    return result;
  };
  const Vector3 middles = middle(step.index, differences.size()) - middle(0, step.index);
  if (middles.dot(step.step) < 0.5 * step.step.squaredNorm()) return;
  fit.bias_step_rad_s = step.step.norm();
  fit.bias_step_sigma_rad_s = step.sigma;
  fit.bias_step_time = pairs[step.index].time;
}

double share_of_scan(ScanStamp stamp) { return stamp == ScanStamp::start ? 0.0 : stamp == ScanStamp::middle ? 0.5 : 1.0; }

/// What concerns the clocks of the IMU and one LiDAR.
Finding clock_finding(const RotationFit& fit, const Platform& platform, std::size_t lidar) {
  const std::string name = lidar == 0 ? "the LiDAR" : lidar_key(lidar);
  const double unexplained = 1.0 - fit.correlation * fit.correlation;
  const double unexplained_unshifted = 1.0 - fit.correlation_unshifted * fit.correlation_unshifted;
  if (std::abs(fit.offset_s) <= telling_offset_s || unexplained_unshifted <= better_by * unexplained) {
    return {Severity::note, "clock.lidar_imu",
            fmt::format("{} and the IMU turn together (correlation {:.3f}), the IMU's stamps {:+.3f} s from the LiDAR's", name,
                        fit.correlation, fit.offset_s),
            ""};
  }
  const double period_s = model_of(platform, lidar).scan_period_s;
  std::string change =
      fmt::format("let one clock stamp both, or shift one sensor's stamps by {:.3f} s", std::abs(fit.offset_s));
  // Where in the scan its stamp would be, for the clocks to agree.
  const double stamped = share_of_scan(layout_of(platform, lidar).stamp.value_or(ScanStamp::start)) - fit.offset_s / period_s;
  for (const auto& [stamp, name_of_stamp] : enum_names(ScanStamp::start)) {
    if (stamp == layout_of(platform, lidar).stamp || std::abs(stamped - share_of_scan(stamp)) > 0.2) continue;
    change = fmt::format("{}.stamp: {}; else ", lidar_key(lidar), name_of_stamp) + change;
  }
  return {
      Severity::warning, "clock.lidar_imu",
      fmt::format(
          "the IMU's stamps are {:.3f} s {} than those of {}: their turns agree to {:.3f} there and to {:.3f} as "
          "stamped (correlation)",
          std::abs(fit.offset_s), fit.offset_s > 0.0 ? "later" : "earlier", name, fit.correlation,
          fit.correlation_unshifted),
      change};
}

Findings check_scale(const RotationFit& fit, const Platform& platform) {
  if (std::abs(fit.scale - 1.0) <= scale_tolerance) return {};
  const bool in_degrees = std::abs(fit.scale / degrees_per_radian - 1.0) < 0.2;
  return {{in_degrees ? Severity::error : Severity::warning, "imu.gyroscope_unit",
           fmt::format("{}: the gyroscope's turns are {:.3f} times those of the LiDAR{}", platform.imu.topic, fit.scale,
                       in_degrees ? ": degrees per second" : ""),
           "an Imu message holds rad/s: convert or calibrate before recording"}};
}

Findings check_axis(const RotationFit& fit, const Platform& platform, std::size_t lidar) {
  if (fit.axis_error_rad <= axis_tolerance_rad) return {};
  const bool inverse = fit.axis_error_inverse_rad < axis_tolerance_rad;
  return {{Severity::error, inverse ? "extrinsic.inverse" : "extrinsic.rotation",
           fmt::format("the axis about which the robot turns differs by {:.1f} deg between IMU and {}; with "
                       "the inverse of T_imu_lidar by {:.1f} deg",
                       fit.axis_error_rad * degrees_per_radian, lidar == 0 ? "LiDAR" : lidar_key(lidar),
                       fit.axis_error_inverse_rad * degrees_per_radian),
           fmt::format("{} {}.T_imu_lidar in {}", inverse ? "invert" : "correct", lidar_key(lidar), platform.file_name())}};
}

Findings check_step(const RotationFit& fit, const Platform& platform) {
  if (fit.bias_step_rad_s <= std::max(telling_step_rad_s, rotation_step_sigmas * fit.bias_step_sigma_rad_s)) return {};
  if (fit.tells() && fit.axis_error_rad >= axis_tolerance_rad) return {};
  return {{Severity::warning, "imu.gyroscope_step",
           fmt::format("{}: the gyroscope's bias steps by {:.4f} rad/s against the LiDAR's turns", platform.imu.topic,
                       fit.bias_step_rad_s),
           "check the IMU (shocks, temperature, power)", fit.bias_step_time}};
}

}  // namespace

std::optional<RotationFit> fit_rotation(const Trajectory& lidar_poses, const std::vector<ImuSample>& imu,
                                        const Quaternion& R_imu_lidar) {
  std::vector<Turn> turns;
  for (std::size_t i = 1; i < lidar_poses.size(); ++i) {
    const StampedPose& before = lidar_poses[i - 1];
    const StampedPose& after = lidar_poses[i];
    const double step_s = to_seconds(after.time - before.time);
    if (step_s > 0.5) continue;
    // Exp(φ) is the turn of the moving frame; φ is the same in the frames before and after it.
    turns.push_back(
        {before.time, after.time, so3::log(before.pose.rotation.conjugate() * after.pose.rotation) / step_s});
  }
  const TurnIntegral gyroscope(imu);
  if (turns.size() < fewest_turns || pairs_at(turns, gyroscope, 0.0).size() < fewest_turns) return std::nullopt;
  RotationFit fit;
  fit.correlation_unshifted = correlation_at(turns, gyroscope, 0.0);
  fit.offset_s = best_offset(turns, gyroscope);
  fit.correlation = correlation_at(turns, gyroscope, fit.offset_s);
  const std::vector<Pair> pairs = pairs_at(turns, gyroscope, fit.offset_s);
  const Moments moments = moments_of(pairs);
  fit.excitation_rad_s = std::sqrt(moments.lidar.trace() / static_cast<double>(pairs.size()));
  const Quaternion aligned = compare_axes(moments, R_imu_lidar, fit);
  // Turns about an axis that is a little off look like a bias while they last.
  find_step(fit.tells() ? pairs : pairs_at(turns, gyroscope, 0.0), fit.tells() ? aligned : R_imu_lidar,
            fit.tells() ? fit.scale : 1.0, fit);
  return fit;
}

Findings check_rotation(const std::optional<RotationFit>& fit, const Platform& platform, std::size_t lidar) {
  Findings findings;
  if (!fit || !fit->tells()) {
    findings.push_back(
        {Severity::note, "clock.untold",
         fit ? fmt::format("the robot turns too little ({:.3f} rad/s rms about the mean) to tell the clocks of "
                           "LiDAR and IMU and the direction of T_imu_lidar",
                           fit->excitation_rad_s)
             : "too few scans that could be followed, with IMU samples, to compare their turns",
         fit ? "--seconds: a longer span, with a turn in it" : ""});
  } else {
    findings.push_back(clock_finding(*fit, platform, lidar));
    if (lidar == 0) append(findings, check_scale(*fit, platform));
    append(findings, check_axis(*fit, platform, lidar));
  }
  if (fit && lidar == 0) append(findings, check_step(*fit, platform));
  return findings;
}

}  // namespace lodestone

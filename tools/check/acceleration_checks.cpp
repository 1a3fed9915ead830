#include "tools/check/acceleration_checks.h"

#include <fmt/format.h>

#include <cmath>

#include "core/angles.h"
#include "frontends/configuration/platform_lidars.h"
#include "tools/check/acceleration_pairs.h"
#include "tools/check/step_search.h"

namespace lodestone {
namespace {

constexpr std::size_t least_side = 3;  // values before and after a step
constexpr double telling_bias_m_s2 = 0.4;
constexpr double telling_step_m_s2 = 0.15;
constexpr double step_sigmas = 8.0;
constexpr double significant_turn_rad = 0.6;  // 35°: limit due to odometry drift and accelerometer bias

}  // namespace

Findings check_acceleration_along(const Trajectory& poses, const LogSample& sample, const Platform& platform) {
  const Vector3 gravity(0.0, 0.0, platform.suite.gravity_m_s2);
  std::vector<Vector3> biases;  // imu frame
  std::vector<Time> times;
  Vector3 mean = Vector3::Zero();
  for (const AccelerationPair& pair : compare_accelerations(poses, sample.imu)) {
    biases.push_back(pair.rotation.conjugate() * (pair.specific_force - pair.acceleration - gravity));
    times.push_back(pair.time);
    mean += biases.back();
  }
  Findings findings;
  if (biases.size() < 2 * least_side) return findings;
  mean /= static_cast<double>(biases.size());
  const LargestStep step = largest_step(biases, least_side);
  if (step.step.norm() > telling_step_m_s2 && step.sigmas() > step_sigmas) {
    findings.push_back(
        {Severity::warning, "imu.accelerometer_step",
         fmt::format("{}: the accelerometer's bias steps by ({:.2f} {:.2f} {:.2f}) m/s2 relative to the path driven",
                     platform.imu.topic, step.step.x(), step.step.y(), step.step.z()),
         "check the IMU (shocks, temperature, power)", times[step.index]});
  } else if (mean.norm() > telling_bias_m_s2) {
    findings.push_back({Severity::warning, "imu.accelerometer_bias",
                        fmt::format("{}: the accelerometer differs by ({:.2f} {:.2f} {:.2f}) m/s2 from the path driven",
                                    platform.imu.topic, mean.x(), mean.y(), mean.z()),
                        "calibrate the accelerometer, level the map, or check the rotation of lidar.T_imu_lidar",
                        times.front()});
  }
  return findings;
}

Findings check_heading(const Trajectory& lidar_poses, const LogSample& sample, const Platform& platform,
                       std::size_t lidar) {
  const Pose& T_imu_lidar = model_of(platform, lidar).T_imu_lidar;
  const HeadingFit given = fit_heading(lidar_poses, sample.imu, T_imu_lidar.rotation);
  if (!given.observable() || std::abs(given.turn_rad) < significant_turn_rad) return {};
  const HeadingFit inverse = fit_heading(lidar_poses, sample.imu, T_imu_lidar.rotation.conjugate());
  const bool inverse_fits = inverse.observable() && std::abs(inverse.turn_rad) < significant_turn_rad;
  return {
      {Severity::error, inverse_fits ? "extrinsic.inverse" : "extrinsic.heading",
       fmt::format(
           "the horizontal accelerations of IMU and LiDAR differ by {:.0f} deg in direction (correlation {:.2f}); with "
           "the inverse of T_imu_lidar {:.0f} deg",
           given.turn_rad * degrees_per_radian, given.correlation, inverse.turn_rad * degrees_per_radian),
       fmt::format("{} {}.T_imu_lidar in {}", inverse_fits ? "invert" : "turn", lidar_key(lidar),
                   platform.file_name())}};
}

}  // namespace lodestone

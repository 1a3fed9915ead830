#include "tools/simulate/world.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "core/error.h"
#include "core/nearest_name.h"

namespace lodestone::simulation {

const std::pair<const std::string, Sequence>& find_sequence(const World& world, const std::string& name) {
  const auto found = name.empty() ? world.sequences.begin() : world.sequences.find(name);
  if (found != world.sequences.end()) return *found;
  throw InputError(fmt::format("{}: sequences: there is no sequence '{}' (known: {})", world.file, name,
                               join_names(world.sequences, &std::map<std::string, Sequence>::value_type::first)));
}

const std::vector<Solid>& find_scene(const World& world, const std::string& name) {
  static const std::vector<Solid> nothing;
  if (name.empty()) return nothing;
  const auto found = world.scenes.find(name);
  if (found != world.scenes.end()) return found->second;
  std::string names = no_scene;
  for (const auto& entry : world.scenes) names += ", " + entry.first;
  throw InputError(fmt::format("{}: scenes: there is no scene '{}' (known: {})", world.file, name, names));
}

SensorSuite sensor_suite(const World& world) {
  SensorSuite suite;
  suite.gravity_m_s2 = world.gravity_m_s2;
  suite.imu.rate_hz = world.imu.rate_hz;
  suite.imu.gyroscope_noise_density = world.imu.gyroscope_noise_density_rad_s_sqrt_hz;
  suite.imu.accelerometer_noise_density = world.imu.accelerometer_noise_density_m_s2_sqrt_hz;
  suite.imu.gyroscope_bias_random_walk = world.imu.gyroscope_bias_random_walk_rad_s2_sqrt_hz;
  suite.imu.accelerometer_bias_random_walk = world.imu.accelerometer_bias_random_walk_m_s3_sqrt_hz;
  suite.lidar.T_imu_lidar = world.lidar.T_imu_lidar();
  suite.lidar.range_noise_m = world.lidar.range_noise_m;
  // At least the default is stated: it also covers the errors of deskewing at long range that its modes omit.
  suite.lidar.direction_noise_rad = std::max(world.lidar.direction_noise_rad, LidarModel{}.direction_noise_rad);
  suite.lidar.min_range_m = world.lidar.min_range_m;
  suite.lidar.max_range_m = world.lidar.max_range_m;
  suite.lidar.scan_period_s = 1.0 / world.lidar.rate_hz;
  for (const MagnetometerMount& mount : world.magnetometers.mounts)
    suite.magnetometers.push_back({mount.name, mount.T_imu_mag(), world.magnetometers.noise_ut});
  if (world.wheels) {
    suite.wheels.emplace();
    suite.wheels->T_imu_wheels = world.wheels->T_imu_wheels();
    suite.wheels->velocity_sigma_m_s = world.wheels->velocity_noise_m_s;
  }
  suite.calibration = calibration_sigmas(world.reality);
  return suite;
}

Vector3 tube_point(const Solid& tube, const Vector3& local) {
  const double curvature = tube.tube_curvature_per_m;
  if (curvature == 0.0) return local;
  const double angle = local.x() * curvature;
  const double radius = 1.0 / curvature - local.y();
  return {radius * std::sin(angle), 1.0 / curvature - radius * std::cos(angle), local.z()};
}

}  // namespace lodestone::simulation

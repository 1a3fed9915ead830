#include "tools/simulate/reality_options.h"

#include <fmt/format.h>

#include <array>
#include <cstddef>

#include "core/error.h"
#include "frontends/configuration/options.h"

namespace lodestone::simulation {
namespace {

void require_between(double value, double least, double most, const char* key) {
  if (value >= least && value <= most) return;  // false for NaN
  throw InputError(fmt::format("{} must be {:g} to {:g}", key, least, most));
}

}  // namespace

void RealityOptions::check() const {
  constexpr double largest_angle_deg = 45.0;
  require_between(lidar_extrinsic_translation_sigma_m, 0.0, 1.0, "lidar_extrinsic_translation_sigma_m");
  require_between(lidar_extrinsic_rotation_sigma_deg, 0.0, largest_angle_deg, "lidar_extrinsic_rotation_sigma_deg");
  require_between(magnetometer_extrinsic_translation_sigma_m, 0.0, 1.0, "magnetometer_extrinsic_translation_sigma_m");
  require_between(magnetometer_extrinsic_rotation_sigma_deg, 0.0, largest_angle_deg,
                  "magnetometer_extrinsic_rotation_sigma_deg");
  require_between(lidar_clock_offset_sigma_s, 0.0, 1.0, "lidar_clock_offset_sigma_s");
  require_between(lidar_stamp_jitter_sigma_s, 0.0, 0.1, "lidar_stamp_jitter_sigma_s");
  require_between(magnetometer_clock_offset_sigma_s, 0.0, 1.0, "magnetometer_clock_offset_sigma_s");
  require_between(range_bias_a_ring_sigma_m, 0.0, 1.0, "range_bias_a_ring_sigma_m");
  require_between(range_bias_at_80deg_incidence_sigma_m, 0.0, 1.0, "range_bias_at_80deg_incidence_sigma_m");
  require_between(imu_scale_sigma, 0.0, 0.2, "imu_scale_sigma");
  require_between(imu_misalignment_sigma_deg, 0.0, largest_angle_deg, "imu_misalignment_sigma_deg");
  require_between(magnetometer_offset_sigma_ut, 0.0, 1000.0, "magnetometer_offset_sigma_ut");
  require_between(magnetometer_matrix_sigma, 0.0, 0.2, "magnetometer_matrix_sigma");
  require_between(platform_field_sigma_ut, 0.0, 1000.0, "platform_field_sigma_ut");
  require_between(cloud_displacement_length_m, 0.1, 1.0e5, "cloud_displacement_length_m");
  require_between(cloud_displacement_rms_m, 0.0, 1.0, "cloud_displacement_rms_m");
  if (cloud_displacement_rms_m > 0.1 * cloud_displacement_length_m) {
    throw InputError(
        "cloud_displacement_rms_m must be at most a tenth of cloud_displacement_length_m: otherwise the "
        "map folds");
  }
  require_between(cloud_noise_m, 0.0, 10.0, "cloud_noise_m");
  require_between(doubled_walls_share, 0.0, 1.0, "doubled_walls_share");
  require_between(doubled_walls_distance_m, 0.0, 10.0, "doubled_walls_distance_m");
  require_between(survey_pose_sigma_m, 0.0, 1.0, "survey_pose_sigma_m");
  require_between(moved_objects_share, 0.0, 1.0, "moved_objects_share");
  require_between(people, 0.0, 200.0, "people");
  require_between(vehicles, 0.0, 200.0, "vehicles");
  require_between(noise_density_factor_max, 1.0, 100.0, "noise_density_factor_max");
  require_between(wheel_scale_sigma, 0.0, 0.2, "wheel_scale_sigma");
  require_between(wheel_rotation_sigma_deg, 0.0, largest_angle_deg, "wheel_rotation_sigma_deg");
  require_between(wheel_slip_sigma, 0.0, 0.2, "wheel_slip_sigma");
}

RealityOptions reality_of(RealityGrade grade) {
  const auto column = static_cast<std::size_t>(grade);
  const auto pick = [column](std::array<double, 4> row) { return row[column]; };
  RealityOptions options;
  options.grade = grade;
  options.lidar_extrinsic_translation_sigma_m = pick({0.0, 0.002, 0.010, 0.030});
  options.lidar_extrinsic_rotation_sigma_deg = pick({0.0, 0.05, 0.3, 1.0});
  options.magnetometer_extrinsic_translation_sigma_m = pick({0.0, 0.001, 0.005, 0.010});
  options.magnetometer_extrinsic_rotation_sigma_deg = pick({0.0, 0.2, 1.0, 3.0});
  options.lidar_clock_offset_sigma_s = pick({0.0, 0.0005, 0.003, 0.010});
  options.lidar_stamp_jitter_sigma_s = pick({0.0, 0.00005, 0.0005, 0.002});
  options.magnetometer_clock_offset_sigma_s = pick({0.0, 0.001, 0.010, 0.030});
  options.range_bias_a_ring_sigma_m = pick({0.0, 0.003, 0.010, 0.020});
  options.range_bias_at_80deg_incidence_sigma_m = pick({0.0, 0.003, 0.010, 0.020});
  options.mixed_points = grade != RealityGrade::exact;
  options.imu_scale_sigma = pick({0.0, 0.001, 0.005, 0.015});
  options.imu_misalignment_sigma_deg = pick({0.0, 0.02, 0.1, 0.3});
  options.magnetometer_offset_sigma_ut = pick({0.0, 0.3, 1.0, 5.0});
  options.magnetometer_matrix_sigma = pick({0.0, 0.002, 0.01, 0.03});
  options.platform_field_sigma_ut = pick({0.0, 0.1, 0.5, 2.0});
  options.cloud_displacement_rms_m = pick({0.0, 0.005, 0.020, 0.050});
  options.cloud_noise_m = pick({0.0, 0.010, 0.015, 0.030});
  options.doubled_walls_share = pick({0.0, 0.0, 0.05, 0.15});
  options.survey_pose_sigma_m = pick({0.0, 0.003, 0.010, 0.030});
  options.moved_objects_share = pick({0.0, 0.01, 0.10, 0.25});
  options.people = pick({0.0, 0.5, 2.0, 6.0});
  options.vehicles = pick({0.0, 0.1, 0.5, 1.5});
  options.noise_density_factor_max = pick({1.0, 1.0, 2.0, 3.0});
  options.wheel_scale_sigma = pick({0.0, 0.002, 0.01, 0.03});
  options.wheel_rotation_sigma_deg = pick({0.0, 0.2, 1.0, 3.0});
  options.wheel_slip_sigma = pick({0.0, 0.002, 0.01, 0.03});
  return options;
}

RealityOptions read_reality(const ConfigurationNode& node) {
  RealityGrade grade = RealityGrade::exact;
  if (node.kind() == ConfigurationNode::Kind::scalar) {
    options_detail::read_value(node, grade);
    return reality_of(grade);
  }
  if (const ConfigurationNode* child = node.find("grade")) options_detail::read_value(*child, grade);
  RealityOptions options = reality_of(grade);
  load_options(node, options);
  return options;
}

CalibrationSigmas calibration_sigmas(const RealityOptions& options) {
  CalibrationSigmas sigmas;
  sigmas.lidar = {options.lidar_extrinsic_translation_sigma_m, options.lidar_extrinsic_rotation_sigma_deg,
                  options.lidar_clock_offset_sigma_s, options.cloud_displacement_rms_m};
  sigmas.magnetometers = {options.magnetometer_extrinsic_translation_sigma_m,
                          options.magnetometer_extrinsic_rotation_sigma_deg,
                          options.magnetometer_clock_offset_sigma_s,
                          options.magnetometer_offset_sigma_ut,
                          options.magnetometer_matrix_sigma,
                          options.survey_pose_sigma_m};
  sigmas.imu = {options.imu_scale_sigma, options.imu_misalignment_sigma_deg};
  sigmas.wheels = {options.wheel_scale_sigma, options.wheel_rotation_sigma_deg, options.wheel_slip_sigma};
  return sigmas;
}

}  // namespace lodestone::simulation

#pragma once

#include "core/options.h"
#include "core/sensor_suite.h"
#include "tools/simulate/reality_grade.h"

namespace lodestone {
class ConfigurationNode;
}

namespace lodestone::simulation {

/// A world's section `reality`: one key per effect. A sigma is the standard deviation of a value that --seed draws and
/// the user does not know. The defaults are those of grade exact: nothing is drawn.
struct RealityOptions {
  RealityGrade grade = RealityGrade::exact;
  double lidar_extrinsic_translation_sigma_m = 0.0;
  double lidar_extrinsic_rotation_sigma_deg = 0.0;
  double magnetometer_extrinsic_translation_sigma_m = 0.0;
  double magnetometer_extrinsic_rotation_sigma_deg = 0.0;
  double lidar_clock_offset_sigma_s = 0.0;
  double lidar_stamp_jitter_sigma_s = 0.0;
  double magnetometer_clock_offset_sigma_s = 0.0;
  double range_bias_a_ring_sigma_m = 0.0;
  double range_bias_at_80deg_incidence_sigma_m = 0.0;
  bool mixed_points = false;
  double imu_scale_sigma = 0.0;
  double imu_misalignment_sigma_deg = 0.0;
  double magnetometer_offset_sigma_ut = 0.0;
  double magnetometer_matrix_sigma = 0.0;
  double platform_field_sigma_ut = 0.0;
  double cloud_displacement_rms_m = 0.0;
  double cloud_displacement_length_m = 20.0;
  double cloud_noise_m = 0.0;
  double doubled_walls_share = 0.0;
  double doubled_walls_distance_m = 0.03;
  double survey_pose_sigma_m = 0.0;
  double moved_objects_share = 0.0;
  double people = 0.0;
  double vehicles = 0.0;
  double noise_density_factor_max = 1.0;
  double wheel_scale_sigma = 0.0;
  double wheel_rotation_sigma_deg = 0.0;
  double wheel_slip_sigma = 0.0;

  /// Throws InputError if a value is out of range.
  void check() const;

  bool has_magnetometer_errors() const {
    return magnetometer_extrinsic_translation_sigma_m > 0.0 || magnetometer_extrinsic_rotation_sigma_deg > 0.0 ||
           magnetometer_offset_sigma_ut > 0.0 || magnetometer_matrix_sigma > 0.0 || platform_field_sigma_ut > 0.0;
  }

  template <class Visitor>
  void visit(Visitor& visitor) {
    visitor.field("grade", grade, "values of all keys that are not stated");
    visitor.field("lidar_extrinsic_translation_sigma_m", lidar_extrinsic_translation_sigma_m,
                  "error of T_imu_lidar in platform.yaml, an axis");
    visitor.field("lidar_extrinsic_rotation_sigma_deg", lidar_extrinsic_rotation_sigma_deg,
                  "error of T_imu_lidar in platform.yaml, an axis");
    visitor.field("magnetometer_extrinsic_translation_sigma_m", magnetometer_extrinsic_translation_sigma_m,
                  "error of each T_imu_mag in platform.yaml, an axis");
    visitor.field("magnetometer_extrinsic_rotation_sigma_deg", magnetometer_extrinsic_rotation_sigma_deg,
                  "error of each T_imu_mag in platform.yaml, an axis");
    visitor.field("lidar_clock_offset_sigma_s", lidar_clock_offset_sigma_s,
                  "constant offset of the LiDAR's stamps against the IMU's");
    visitor.field("lidar_stamp_jitter_sigma_s", lidar_stamp_jitter_sigma_s, "jitter of each scan's stamp");
    visitor.field("magnetometer_clock_offset_sigma_s", magnetometer_clock_offset_sigma_s,
                  "constant offset of all magnetometers' stamps against the IMU's");
    visitor.field("range_bias_a_ring_sigma_m", range_bias_a_ring_sigma_m, "constant range bias of each ring");
    visitor.field("range_bias_at_80deg_incidence_sigma_m", range_bias_at_80deg_incidence_sigma_m,
                  "range bias at 80 degrees of incidence; it grows with the tangent of the angle");
    visitor.field("mixed_points", mixed_points, "whether a beam that straddles an edge may return a point in between");
    visitor.field("imu_scale_sigma", imu_scale_sigma, "scale error of each axis, a share");
    visitor.field("imu_misalignment_sigma_deg", imu_misalignment_sigma_deg,
                  "misalignment of each axis towards each other axis");
    visitor.field("magnetometer_offset_sigma_ut", magnetometer_offset_sigma_ut,
                  "residual offset of each magnetometer, a component");
    visitor.field("magnetometer_matrix_sigma", magnetometer_matrix_sigma,
                  "residual soft iron of each magnetometer, an entry of a symmetric matrix");
    visitor.field("platform_field_sigma_ut", platform_field_sigma_ut,
                  "field of the motors at 0.5 m/s2 or 0.5 rad/s, a component");
    visitor.field("cloud_displacement_rms_m", cloud_displacement_rms_m,
                  "smooth displacement of both maps, a component");
    visitor.field("cloud_displacement_length_m", cloud_displacement_length_m, "correlation length of the displacement");
    visitor.field("cloud_noise_m", cloud_noise_m,
                  "noise of the surveyed points, a component; 0: the world's cloud.noise_m");
    visitor.field("doubled_walls_share", doubled_walls_share, "share of the surfaces that the cloud map has twice");
    visitor.field("doubled_walls_distance_m", doubled_walls_distance_m, "distance between the two copies");
    visitor.field("survey_pose_sigma_m", survey_pose_sigma_m,
                  "slow error of the survey's trajectory over about 20 s, a component");
    visitor.field("moved_objects_share", moved_objects_share,
                  "share of the movable objects that were moved, removed or added since the survey");
    visitor.field("people", people, "number of people near the robot, on average at any time");
    visitor.field("vehicles", vehicles, "number of vehicles near the robot, on average at any time");
    visitor.field("noise_density_factor_max", noise_density_factor_max,
                  "the IMU's densities in platform.yaml are the true ones times a factor between 1 / this and this");
    visitor.field("wheel_scale_sigma", wheel_scale_sigma, "scale error of the wheels' velocity, a share");
    visitor.field("wheel_rotation_sigma_deg", wheel_rotation_sigma_deg,
                  "error of the rotation of T_imu_wheels in platform.yaml, an axis");
    visitor.field("wheel_slip_sigma", wheel_slip_sigma, "slow slip of the wheels over about 20 s, a share");
  }
};

/// The values of a grade.
RealityOptions reality_of(RealityGrade grade);

/// Reads the name of a grade, or a map with a grade and keys that override its values. Throws InputError.
RealityOptions read_reality(const ConfigurationNode& node);

/// The sigmas that a user who knows the grade states in the platform file.
CalibrationSigmas calibration_sigmas(const RealityOptions& options);

}  // namespace lodestone::simulation

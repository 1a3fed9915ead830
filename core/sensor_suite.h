#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/geometry/pose.h"
#include "core/options.h"

namespace lodestone {

/// Continuous-time noise of an IMU, one value for all three axes.
struct ImuNoise {
  double gyroscope_noise_density = 2.0e-3;         ///< rad/s/√Hz
  double accelerometer_noise_density = 2.0e-2;     ///< m/s²/√Hz
  double gyroscope_bias_random_walk = 2.0e-5;      ///< rad/s²/√Hz
  double accelerometer_bias_random_walk = 2.0e-4;  ///< m/s³/√Hz
  double rate_hz = 200.0;
};

struct LidarModel {
  Pose T_imu_lidar;
  double range_noise_m = 0.02;        ///< one sigma along the beam
  double direction_noise_rad = 3e-4;  ///< one sigma of a beam's direction, in each of the two directions across it
  double min_range_m = 0.5;
  double max_range_m = 100.0;
  double scan_period_s = 0.1;
};

struct MagnetometerModel {
  std::string name;
  Pose T_imu_mag;
  double noise_ut = 1.0;  ///< white, one sigma for each sample and component
};

/// What is known about motion of the wheel frame to the side.
enum class LateralMotion {
  unknown,   ///< only the forward velocity is used
  measured,  ///< the wheels measure the lateral velocity (mecanum or swerve drive)
  none       ///< non-holonomic: the robot moves neither sideways nor vertically
};

constexpr auto enum_names(LateralMotion) {
  return EnumNames<LateralMotion, 3>{
      {{LateralMotion::unknown, "unknown"}, {LateralMotion::measured, "measured"}, {LateralMotion::none, "none"}}};
}

/// Wheel odometry: velocities of the wheel frame (x forwards, y left), usually base_link.
struct WheelModel {
  Pose T_imu_wheels;
  double velocity_sigma_m_s = 0.02;  ///< white, one sigma of a sample's velocity
  LateralMotion lateral_motion = LateralMotion::unknown;
  double lateral_sigma_m_s = 0.05;  ///< of the lateral and vertical velocity between two scans, if `none`
};

/// Uncertainty of T_imu_lidar, of the LiDAR's clock and of the cloud map.
struct LidarCalibrationSigmas {
  double translation_sigma_m = 0.010;       ///< of T_imu_lidar, each axis
  double rotation_sigma_deg = 0.3;          ///< of T_imu_lidar, each axis
  double clock_sigma_s = 0.003;             ///< of the LiDAR's stamps relative to the IMU's: one constant offset
  double map_displacement_sigma_m = 0.020;  ///< of the cloud map, each axis, over tens of metres: bends of its survey
};

/// Uncertainty of each magnetometer's calibration and of the array's clock.
struct MagnetometerCalibrationSigmas {
  double translation_sigma_m = 0.005;  ///< of T_imu_mag, each axis
  double rotation_sigma_deg = 1.0;     ///< of T_imu_mag, each axis
  double clock_sigma_s = 0.010;        ///< of the array's stamps relative to the IMU's: one constant offset
  double offset_sigma_ut = 1.0;        ///< of the residual hard iron, each component
  double matrix_sigma = 0.01;          ///< of the residual soft iron, each entry of the 3×3 matrix
  double survey_pose_sigma_m = 0.010;  ///< of the field map's place in the cloud map, each axis: slow errors of surveys
};

/// Uncertainty of the IMU's axes.
struct ImuCalibrationSigmas {
  double scale_sigma = 0.005;           ///< of the scale of an axis, relative
  double misalignment_sigma_deg = 0.1;  ///< of one axis relative to another
};

/// Uncertainty of the wheels' calibration, and of their slip.
struct WheelCalibrationSigmas {
  double scale_sigma = 0.01;        ///< of the scale of velocities, relative: a constant
  double rotation_sigma_deg = 1.0;  ///< of T_imu_wheels, each axis
  double slip_sigma = 0.01;         ///< of the slowly varying part of the scale, relative
};

/// One standard deviation of every part of the calibration; 0: exact. The defaults are those of grade `field`
/// (config/worlds/README.md, section Reality): the calibration of a usual robot.
struct CalibrationSigmas {
  LidarCalibrationSigmas lidar;  ///< of the first LiDAR; the others move rigidly with it
  MagnetometerCalibrationSigmas magnetometers;
  ImuCalibrationSigmas imu;
  WheelCalibrationSigmas wheels{};
};

/// A calibration without errors.
constexpr CalibrationSigmas exact_calibration() {
  return {{0.0, 0.0, 0.0, 0.0}, {0.0, 0.0, 0.0, 0.0, 0.0, 0.0}, {0.0, 0.0}, {0.0, 0.0, 0.0}};
}

/// The sensors of a robot, for the estimators. Topics and message layouts belong to the reader.
struct SensorSuite {
  ImuNoise imu;
  LidarModel lidar;                        ///< the first: scans are in its frame
  std::vector<LidarModel> further_lidars;  ///< usually none; they move rigidly with the first
  std::vector<MagnetometerModel> magnetometers;
  std::optional<WheelModel> wheels{};  ///< empty: no wheel odometry
  double gravity_m_s2 = 9.80665;
  CalibrationSigmas calibration{};

  /// The first and the further ones, by LidarPoint::lidar.
  std::vector<LidarModel> lidars() const {
    std::vector<LidarModel> all{lidar};
    all.insert(all.end(), further_lidars.begin(), further_lidars.end());
    return all;
  }

  /// Replaces the largest range of every LiDAR.
  void set_max_range(double max_range_m) {
    lidar.max_range_m = max_range_m;
    for (LidarModel& further : further_lidars) further.max_range_m = max_range_m;
  }
};

}  // namespace lodestone

#pragma once

#include <cstdint>
#include <vector>

#include "tools/simulate/displacement_field.h"
#include "tools/simulate/world.h"

namespace lodestone::simulation {

/// True errors of a LiDAR against platform.yaml.
struct LidarErrors {
  Vector6 mounting = Vector6::Zero();  ///< true T_imu_lidar = believed ⊞ this; φ (rad), p (m, imu axes)
  double clock_offset_s = 0.0;         ///< stamp = true time + this + jitter
  double stamp_jitter_sigma_s = 0.0;   ///< of each scan's stamp
  std::vector<double> ring_bias_m;     ///< added to the ranges of a ring; empty: none
  double incidence_bias_m = 0.0;       ///< added to a range at 80° of incidence; grows with the tangent
  bool mixed_points = false;
};

/// Reading = matrix · true value, before bias and noise; imu axes.
struct ImuErrors {
  Matrix3 gyroscope = Matrix3::Identity();
  Matrix3 accelerometer = Matrix3::Identity();
};

/// True errors of a magnetometer against platform.yaml.
struct MagnetometerErrors {
  Vector6 mounting = Vector6::Zero();            ///< true T_imu_mag = believed ⊞ this
  Matrix3 matrix = Matrix3::Identity();          ///< reading = matrix · field + offset + noise, sensor axes
  Vector3 offset_ut = Vector3::Zero();           ///< sensor axes
  Vector3 acceleration_field = Vector3::Zero();  ///< field of the motors, µT per m/s² of commanded acceleration
  Vector3 turning_field = Vector3::Zero();       ///< field of the motors, µT per rad/s of commanded yaw rate
};

/// True errors of the wheels against platform.yaml. The reported velocity is (scale + slip) times the true one.
struct WheelErrors {
  double scale = 1.0;
  Vector6 mounting = Vector6::Zero();  ///< true T_imu_wheels = believed ⊞ this; the position is exact
  DisplacementField slip;              ///< its x at (seconds, 0, 0), a share
};

/// Noise densities in the platform file, divided by the true ones.
struct DensityFactors {
  double gyroscope_noise = 1.0;
  double accelerometer_noise = 1.0;
  double gyroscope_bias_walk = 1.0;
  double accelerometer_bias_walk = 1.0;
};

/// All values of a world's section `reality` that --seed draws before a drive. Every effect has its own random stream:
/// no key changes the draws of another. Drive and survey share the robot: mounting, clocks, IMU and motors. The
/// magnetometers' residual errors differ between the two days: matrix and offset of the survey are drawn anew.
struct Reality {
  RealityOptions options;
  std::uint64_t seed = 0;
  LidarErrors lidar;
  ImuErrors imu;
  std::vector<MagnetometerErrors> magnetometers;         ///< on the drive
  std::vector<MagnetometerErrors> survey_magnetometers;  ///< on the survey: other matrix and offset
  double magnetometer_clock_offset_s = 0.0;              ///< stamp = true time + this
  WheelErrors wheels;
  DensityFactors densities;
  DisplacementField displacement;  ///< of both maps against the true world
};

Reality draw_reality(const World& world, std::uint64_t seed);

/// believed ⊞ error; identical bits to `believed` if the error is zero.
Pose with_error(const Pose& believed, const Vector6& error);

/// The robot as stated in the platform file: the world's sensors, with densities multiplied by the drawn factors.
SensorSuite believed_suite(const World& world, const Reality& reality);

}  // namespace lodestone::simulation

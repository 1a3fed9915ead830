#pragma once

#include <string>
#include <vector>

#include "core/geometry/pose.h"

namespace lodestone {

/// Continuous-time noise of an IMU, one value for all three axes.
struct ImuNoise {
  double gyroscope_noise_density = 2.0e-3;       ///< rad/s/√Hz
  double accelerometer_noise_density = 2.0e-2;   ///< m/s²/√Hz
  double gyroscope_bias_random_walk = 2.0e-5;    ///< rad/s²/√Hz
  double accelerometer_bias_random_walk = 2.0e-4;  ///< m/s³/√Hz
  double rate_hz = 200.0;
};

struct LidarModel {
  Pose T_imu_lidar;
  double range_noise_m = 0.02;   ///< one sigma along the beam
  double direction_noise_rad = 3e-4;  ///< one sigma of a beam's direction, in each of the two directions across it
  double min_range_m = 0.5;
  double max_range_m = 100.0;
  double scan_period_s = 0.1;
};

struct MagnetometerModel {
  std::string name;
  Pose T_imu_mag;
  double noise_ut = 1.0;  ///< white, one sigma a sample and component
};

/// The sensors of a robot as the mathematics needs them. Topics and message layouts belong to the reader.
struct SensorSuite {
  ImuNoise imu;
  LidarModel lidar;
  std::vector<MagnetometerModel> magnetometers;
  double gravity_m_s2 = 9.80665;
};

}  // namespace lodestone

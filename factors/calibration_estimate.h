#pragma once

#include <vector>

#include "core/geometry/pose.h"
#include "core/imu/preintegration.h"
#include "core/lidar/lidar_correction.h"
#include "core/wheels/wheel_correction.h"

namespace lodestone {

/// The calibration estimated from a log, as differences from the platform file, each with one sigma. A part that was
/// not estimated is zero with sigma zero.
struct CalibrationEstimate {
  struct Lidar {
    LidarCorrection correction;
    Vector3 turn_sigma_rad = Vector3::Zero();
    Vector3 shift_sigma_m = Vector3::Zero();
    double clock_sigma_s = 0.0;
  };
  struct Magnetometer {
    Vector3 turn_rad = Vector3::Zero();  ///< θ of T_imu_mag = T₀ Exp(θ), magnetometer axes
    Vector3 turn_sigma_rad = Vector3::Zero();
    Vector6 distortion = Vector6::Zero();  ///< symmetric part of E: xx, xy, xz, yy, yz, zz
    Vector6 distortion_sigma = Vector6::Zero();
  };
  struct Imu {
    ImuAxes axes = ImuAxes::Zero();
    ImuAxes sigma = ImuAxes::Zero();
  };
  struct Wheels {
    WheelCorrection correction;  ///< constant part of the scale, without slip
    double scale_sigma = 0.0;
    Vector3 turn_sigma_rad = Vector3::Zero();
  };
  Imu imu;
  Lidar lidar;
  Wheels wheels;
  std::vector<Magnetometer> magnetometers;
  double magnetometer_clock_s = 0.0;  ///< delay of the array's stamps
  double magnetometer_clock_sigma_s = 0.0;

  /// Parameters of each magnetometer: its rotation, then its distortion.
  static constexpr int kMatrixParameters = 9;

  /// E = −hat(θ) + S of nine parameters: readings are bias + (1 + E) field.
  static Matrix3 matrix_of(const double* parameters) {
    Matrix3 result = -so3::hat(Vector3(parameters));
    const double* s = parameters + 3;
    Matrix3 symmetric;
    symmetric << s[0], s[1], s[2], s[1], s[3], s[4], s[2], s[4], s[5];
    return result + symmetric;
  }
};

}  // namespace lodestone

#pragma once

#include <vector>

#include "core/geometry/pose.h"
#include "core/sensor_suite.h"
#include "core/time.h"

namespace lodestone {

/// Correction of the LiDAR's calibration in the platform file: T_imu_lidar is (Exp(turn) R₀, t₀ + shift), and stamps
/// are late by `clock_s`.
struct LidarCorrection {
  Vector3 turn_rad = Vector3::Zero();  ///< imu axes
  Vector3 shift_m = Vector3::Zero();   ///< imu axes
  double clock_s = 0.0;                ///< stamp minus the time, on the imu's clock, at which a point was taken

  Pose corrected(const Pose& T_imu_lidar) const {
    Pose result;
    result.rotation = (so3::exp(turn_rad) * T_imu_lidar.rotation).normalized();
    result.position = T_imu_lidar.position + shift_m;
    return result;
  }

  /// Corrects all LiDARs. The correction applies to the first; the others move rigidly with it.
  std::vector<LidarModel> corrected(std::vector<LidarModel> lidars) const {
    const Pose given = lidars.front().T_imu_lidar;
    const Pose found = corrected(given);
    lidars.front().T_imu_lidar = found;
    for (std::size_t i = 1; i < lidars.size(); ++i) {
      lidars[i].T_imu_lidar = found * (given.inverse() * lidars[i].T_imu_lidar);
    }
    return lidars;
  }

  Time clock() const { return from_seconds(clock_s); }
};

}  // namespace lodestone

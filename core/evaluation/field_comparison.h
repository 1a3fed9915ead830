#pragma once

#include <functional>
#include <limits>
#include <optional>
#include <vector>

#include "core/evaluation/array_log.h"
#include "core/geometry/trajectory.h"
#include "core/magnetometer/magnetic_map.h"
#include "core/sensor_suite.h"

namespace lodestone {

/// One reading held against the map, at the place where the trajectory says it was made. Covariances in µT², map axes.
struct FieldDifference {
  int magnetometer = 0;
  Vector3 position = Vector3::Zero();       ///< of the magnetometer, map, metres
  Matrix3 R_map_mag = Matrix3::Identity();  ///< turns magnetometer axes to map axes
  Vector3 difference_ut = Vector3::Zero();  ///< measured minus map, map axes
  double noise_variance = 0.0;              ///< of the reading, a component: independent from reading to reading
  double map_variance = 0.0;                ///< of the map, a component: alike for neighbours
  Matrix3 pose_variance = Matrix3::Zero();  ///< J P Jᵀ of the pose's covariance: alike for neighbours
};

/// The array at one time.
struct ComparedArray {
  Time time = 0;
  std::size_t pose_index = 0;  ///< the trajectory's pose at this time or the next later: its scan
  bool moved = false;          ///< since the last one of which this was said: what is read at a standstill counts once
  std::vector<FieldDifference> differences;  ///< of the magnetometers that read something where the map has a field
};

/// What was measured, where it was, and what the map says: everything that a comparison needs. All must outlive it.
struct FieldComparison {
  const ArrayLog& readings;
  const SensorSuite& suite;
  const Trajectory& trajectory;             ///< T_map_imu
  const std::vector<Matrix6>& covariances;  ///< one a pose; φ (right, rad), p (map, m)
  std::function<std::optional<FieldValue>(const Vector3&)> map;
  std::optional<double> only_height_m;  ///< the height of a map of one layer, which knows no slope along z
  double map_sigma_floor_ut = 0.2;
  Time trusted_until = std::numeric_limits<Time>::max();  ///< readings later than this are left out
};

/// Calls `visit` for every array reading that has a pose, in order of time. A map of one layer gets its slope along z
/// from Maxwell (no curl, no divergence), and readings off its height the variance that this slope gives.
void compare_field(const FieldComparison& comparison, const std::function<void(const ComparedArray&)>& visit);

}  // namespace lodestone

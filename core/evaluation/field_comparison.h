#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "core/evaluation/array_log.h"
#include "core/geometry/trajectory.h"
#include "core/magnetometer/magnetic_map.h"
#include "core/sensor_suite.h"

namespace lodestone {

/// The difference of one reading and the map, at the position given by the trajectory. Covariances in µT², map axes.
struct FieldDifference {
  int magnetometer = 0;
  Vector3 position = Vector3::Zero();       ///< of the magnetometer, map, metres
  Matrix3 R_map_mag = Matrix3::Identity();  ///< rotates magnetometer axes to map axes
  Vector3 difference_ut = Vector3::Zero();  ///< measured minus map, map axes
  double noise_variance = 0.0;              ///< of the reading, per component; white
  double map_variance = 0.0;                ///< of the map, per component; correlated between neighbours
  Matrix3 pose_variance = Matrix3::Zero();  ///< J P Jᵀ of the pose's covariance; correlated between neighbours
};

/// The differences of all magnetometers at one time.
struct ComparedArray {
  Time time = 0;
  std::size_t pose_index = 0;                ///< index of the pose at this time, or of the next pose
  bool moved = false;                        ///< since the last reading with `moved`; a standstill counts once
  std::vector<FieldDifference> differences;  ///< of magnetometers with a reading and a map value
};

/// The inputs of a comparison of readings with the map. All references, and the map, must outlive this struct.
struct FieldComparison {
  const ArrayLog& readings;
  const SensorSuite& suite;
  const Trajectory& trajectory;             ///< T_map_imu
  const std::vector<Matrix6>& covariances;  ///< one per pose; φ (right, rad), p (map, m)
  std::function<std::optional<FieldValue>(const Vector3&)> map;
  std::optional<double> only_height_m;  ///< height of a map with a single layer, which has no slope along z
};

/// Of readings with a map.
FieldComparison comparison_with(const MagneticMap& map, FieldInterpolation interpolation, const ArrayLog& readings,
                                const SensorSuite& suite, const Trajectory& trajectory,
                                const std::vector<Matrix6>& covariances);

/// Calls `visit` for every array reading that has a pose, in order of time. If the map has a single layer, the slope
/// along z follows from Maxwell (no curl, no divergence), and readings off its height get a larger variance.
void compare_field(const FieldComparison& comparison, const std::function<void(const ComparedArray&)>& visit);

}  // namespace lodestone

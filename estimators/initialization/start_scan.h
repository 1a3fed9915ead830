#pragma once

#include <optional>
#include <span>
#include <vector>

#include "core/imu/scan_motion.h"
#include "core/lidar/scan_lidars.h"
#include "core/measurements.h"
#include "core/sensor_suite.h"
#include "estimators/initialization/place_search.h"

namespace lodestone {

/// The floor in a scan: nᵀ x + d = 0 in the imu frame, n upwards.
struct GroundPlane {
  Vector3 normal = Vector3::UnitZ();
  double height_m = 0.0;  ///< d: height of the imu above the floor
  int points = 0;         ///< number of points on the floor
};

/// The first scan of a log, before its pose is known.
struct StartScan {
  std::vector<Eigen::Vector3f> points;  ///< imu frame at the scan's end, deskewed with the gyroscope and a velocity
  ScanLidars lidars{LidarModel{}};      ///< of these points
  Vector3 up = Vector3::UnitZ();        ///< opposite to gravity, imu frame at the scan's end, from the accelerometer
  std::optional<GroundPlane> ground;    ///< empty if the scan has no level floor below the robot
};

/// Fewest points of a scan that the search uses.
inline constexpr std::size_t kLeastStartPoints = 100;

/// At most `most` of the points, evenly distributed over their order.
template <class Point>
std::vector<Point> thinned(std::vector<Point> points, std::size_t most) {
  if (points.size() <= most) return points;
  for (std::size_t i = 0; i < most; ++i) points[i] = points[i * points.size() / most];
  points.resize(most);
  return points;
}

/// The samples of successive bundles, which share those at their ends.
std::vector<ImuSample> imu_of(std::span<const ScanBundle> bundles);

/// The direction opposite to gravity in the imu frame at the first sample's time: the mean of the accelerometer over
/// all samples, rotated there by the gyroscope. A change of velocity of 1 m/s within 5 s tilts it by 1°.
Vector3 mean_up(std::span<const ImuSample> samples);

/// The attitude at yaw 0 in which `up` (imu frame) points along the map's z.
Quaternion level_attitude(const Vector3& up);

/// The level plane (within 4° of `up`) below the imu with the most points within 15 m, at least 30. Planes are sampled
/// from triples of points in a fixed sequence, so that the same scan gives the same plane.
std::optional<GroundPlane> find_ground(std::span<const Eigen::Vector3f> points, const Vector3& up);

/// Prepares all points of a scan, which is sampled already. `velocity_imu`: m/s, imu frame at the scan's end; zero if
/// unknown.
StartScan prepare_start(const ScanBundle& bundle, const Vector3& up_at_end, const Vector3& velocity_imu,
                        const SensorSuite& suite);

/// Attitude at yaw 0 in which the floor is level. If gravity and the floor differ by more than 3° (a ramp, or no
/// floor), the attitude from gravity.
Quaternion start_attitude(const StartScan& scan);

/// Height of the imu above the floor, metres. Without a ground plane: above the lowest fiftieth of the points.
double height_above_floor(const StartScan& scan);

/// The points for the search: those above the floor, up to `range_m`, at most `most`, evenly distributed over the
/// voxels of the surroundings.
std::vector<SearchPoint> search_points(const StartScan& scan, double range_m, int most);

}  // namespace lodestone

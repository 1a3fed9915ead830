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

/// The floor as a scan shows it: nᵀ x + d = 0 in the imu frame, n upwards.
struct GroundPlane {
  Vector3 normal = Vector3::UnitZ();
  double height_m = 0.0;  ///< d: of the imu above it
  int points = 0;         ///< that lie on it
};

/// What the first scan of a log says before anyone knows where it was taken.
struct StartScan {
  std::vector<Eigen::Vector3f> points;  ///< imu frame at the scan's end, deskewed with the gyroscope and a velocity
  ScanLidars lidars{LidarModel{}};      ///< that measured them
  Vector3 up = Vector3::UnitZ();        ///< against gravity, imu frame at the scan's end, from the accelerometer
  std::optional<GroundPlane> ground;    ///< nothing where the scan shows no level floor below the robot
};

/// Against gravity in the imu frame at the first sample's time: the mean of the accelerometer over all samples, turned
/// there by the gyroscope. A robot that changes its velocity by 1 m/s within 5 s tilts it by 1°.
Vector3 mean_up(std::span<const ImuSample> samples);

/// The attitude at yaw 0 in which `up` (imu frame) points along the map's z.
Quaternion level_attitude(const Vector3& up);

/// The level plane (within 4° of `up`) below the imu that holds most points within 15 m, at least 30, by sampled
/// triples; fixed sampling, so that the same scan gives the same plane.
std::optional<GroundPlane> find_ground(std::span<const Eigen::Vector3f> points, const Vector3& up);

/// Prepares a scan. `voxel_m`: one point is kept in each. `velocity_imu`: m/s, imu frame at the scan's end; zero where
/// it is not known.
StartScan prepare_start(const ScanBundle& bundle, const Vector3& up_at_end, const Vector3& velocity_imu,
                        const SensorSuite& suite, double voxel_m);

/// Attitude at yaw 0: that in which the floor is level; where gravity and the floor differ by more than 3° (a ramp, or
/// no floor) that of gravity.
Quaternion start_attitude(const StartScan& scan);

/// Height of the imu above the floor, metres: of the ground plane; without one, of the lowest fiftieth of the points.
double height_above_floor(const StartScan& scan);

/// The points that take part in the search: those above the floor, up to `range_m`, at most `most`, spread evenly over
/// the voxels of the surroundings.
std::vector<SearchPoint> search_points(const StartScan& scan, double range_m, int most);

}  // namespace lodestone

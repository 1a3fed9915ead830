#pragma once

#include <functional>
#include <optional>

#include "core/lidar/plane_map_source.h"
#include "tools/check/finding.h"
#include "tools/check/log_sample.h"
#include "tools/check/scan_odometry.h"

namespace lodestone {

/// A place on the map where the scan fits, found without the initial pose.
struct PlaceOnMap {
  Pose T_map_imu;
  double share = 0.0;  ///< share of the scan's points on the map there
  bool sure = false;   ///< no other place fits equally well
};

/// Inputs of check_initial_pose. All references must outlive it.
struct InitialPoseInputs {
  const LogSample& sample;
  const Platform& platform;
  const ScanOdometry& odometry;
  const PlaneMapSource& map;
  Pose start;  ///< given T_map_imu at the first scan
  std::function<std::optional<PlaceOnMap>()>
      find_anywhere;                   ///< needs seconds; called only if the initial pose does not fit; may be null
  Vector3 origin_m = Vector3::Zero();  ///< of the site; added to proposed poses
};

/// Registers the first scan to the map at the initial pose: share of points on the map, error of the initial pose,
/// T_imu_lidar or its inverse, and tilt of gravity on the map. If nothing fits, searches for another initial pose.
Findings check_initial_pose(const InitialPoseInputs& inputs);

/// Without a map: compares the floor of the first scan with gravity, for the given T_imu_lidar and its inverse.
Findings check_floor(const LogSample& sample, const Platform& platform, const ScanOdometry& odometry);

}  // namespace lodestone

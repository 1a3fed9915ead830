#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/lidar/plane_map.h"
#include "core/sensor_suite.h"
#include "core/warnings.h"

namespace lodestone {

struct LoadedPlanes {
  std::shared_ptr<const PlaneMapSource> source;
  std::vector<Eigen::Vector3f> points{};  ///< that the planes were fitted to; none of a map in tiles
  std::string description;                ///< number of planes and their storage, as text
};

/// Largest distance from the robot at which a scan requires the map, m: the LiDARs' range and a margin for motion.
double map_reach_m(std::span<const LidarModel> lidars);

/// The planes of a cloud map: in memory for up to PlaneMapOptions::tile_above_points points, otherwise in tiles in a
/// temporary file in `folder`. Estimators get the same planes in both cases. `origin_m` is subtracted from all points.
/// Throws InputError (as read_point_cloud; if the disk is full).
LoadedPlanes load_planes(const std::string& path, const PlaneMapOptions& options, std::span<const LidarModel> lidars,
                         const std::string& folder, WarningLog& warnings, const Vector3& origin_m = Vector3::Zero());

}  // namespace lodestone

#pragma once

#include <memory>
#include <string>

#include "core/lidar/plane_map.h"
#include "core/sensor_suite.h"
#include "core/warnings.h"

namespace lodestone {

struct LoadedPlanes {
  std::shared_ptr<const PlaneMapSource> source;
  std::string description;  ///< how many planes, and how they are kept, in a few words
};

/// The planes of a cloud map: of up to PlaneMapOptions::tile_above_points points in memory, of more in tiles in a
/// temporary file in `folder`. Estimators get the same planes either way. Throws InputError (read_point_cloud's; where
/// resident_radius_m is less than the LiDAR's range asks for; where the disk is full).
LoadedPlanes load_planes(const std::string& path, const PlaneMapOptions& options, const LidarModel& lidar,
                         const std::string& folder, WarningLog& warnings);

}  // namespace lodestone

#pragma once

#include <string>

#include "core/lidar/cloud_quality.h"
#include "tools/check/finding.h"

namespace lodestone {

/// A cloud map as `check --cloud` measured it.
struct CloudMeasurement {
  CloudQuality quality;
  std::int64_t points = 0;                           ///< in the file
  Eigen::Vector3f low_m = Eigen::Vector3f::Zero();   ///< least x, y, z of the whole file, map
  Eigen::Vector3f high_m = Eigen::Vector3f::Zero();  ///< largest x, y, z of the whole file, map
};

/// Reads the cloud at `path` and measures it with the voxels of `options`. Of a cloud above options.tile_above_points,
/// cubes that are spread evenly over the site are measured, in all at most so many points. Throws InputError where the
/// cloud cannot be read.
CloudMeasurement measure_cloud_file(const std::string& path, const PlaneMapOptions& options);

/// What the map lacks: cloud.sparse, cloud.thick, cloud.doubled, cloud.off_planes.
Findings check_cloud(const CloudMeasurement& measured, const PlaneMapOptions& options, const std::string& path);

}  // namespace lodestone

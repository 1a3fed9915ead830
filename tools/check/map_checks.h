#pragma once

#include <span>

#include "core/lidar/plane_map.h"
#include "tools/check/finding.h"

namespace lodestone {

/// Quality of a cloud map: share of voxels with a plane, thickness of planes (median and interquartile range; rms
/// distance of points), density of points on surfaces, and share of doubled surfaces. `points`: of the cloud; empty if
/// the map is in tiles, and then doubled surfaces are not checked.
Findings check_map(const PlaneMapSource& map, const PlaneMapOptions& options, std::span<const Eigen::Vector3f> points);

}  // namespace lodestone

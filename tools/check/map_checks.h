#pragma once

#include <span>

#include "core/lidar/plane_map.h"
#include "tools/check/finding.h"

namespace lodestone {

/// What a cloud map is good for: how many of its voxels hold a plane, how thick planes are (median and the half in the
/// middle, rms distance of points), how densely surfaces are covered, and how many are there twice. `points`: of the
/// cloud; empty where it is held in tiles, and then nothing is said of surfaces that are there twice.
Findings check_map(const PlaneMapSource& map, const PlaneMapOptions& options, std::span<const Eigen::Vector3f> points);

}  // namespace lodestone

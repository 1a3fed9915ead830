#pragma once

#include <Eigen/Core>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "core/geometry/so3.h"
#include "core/warnings.h"

namespace lodestone {

/// Positions of a point-cloud map (PCD in ascii, binary or compressed; PLY; LAS), metres, in the file's order, less
/// `origin_m`. Points that are not finite, or farther than 131 km from the origin, are dropped and counted
/// ("cloud.nan_points", "cloud.far_points"), as are points marked as noise ("cloud.marked_points"). Throws InputError
/// with the file's name if the file is missing, of another format, malformed, without x, y, z, has no points, has most
/// points so far from the origin that floats are too coarse, or is a text with more points than PCL supports.
std::vector<Eigen::Vector3f> read_point_cloud(const std::string& path, WarningLog& warnings,
                                              const Vector3& origin_m = Vector3::Zero());

using PointSink = std::function<void(std::span<const Eigen::Vector3f>)>;

/// The same in pieces: of an uncompressed binary PCD, a PLY or a LAS file of any size, only one piece is in memory.
/// Other formats are read completely first.
void stream_point_cloud(const std::string& path, WarningLog& warnings, const PointSink& sink,
                        const Vector3& origin_m = Vector3::Zero());

}  // namespace lodestone

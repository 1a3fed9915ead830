#pragma once

#include <Eigen/Core>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "core/warnings.h"

namespace lodestone {

/// Positions of a point-cloud map (PCD in ascii, binary or compressed; PLY), metres, in the file's order. Points that
/// are not finite, or farther than 131 km from the origin, are dropped and counted ("cloud.nan_points",
/// "cloud.far_points"). Throws InputError with the file's name if the file is missing, of another format, malformed,
/// without x, y, z, has no points, has most points so far from the origin that floats are too coarse, or is a text with
/// more points than PCL supports.
std::vector<Eigen::Vector3f> read_point_cloud(const std::string& path, WarningLog& warnings);

using PointSink = std::function<void(std::span<const Eigen::Vector3f>)>;

/// The same in pieces: for an uncompressed binary PCD of any size, only one piece is in memory. Other formats are read
/// completely first.
void stream_point_cloud(const std::string& path, WarningLog& warnings, const PointSink& sink);

/// Writes positions as a binary PCD under a temporary name and renames it. Throws InputError.
void write_point_cloud(const std::string& path, const std::vector<Eigen::Vector3f>& points);

}  // namespace lodestone

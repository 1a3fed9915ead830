#pragma once

#include <Eigen/Core>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "core/warnings.h"

namespace lodestone {

/// Positions of a point-cloud map (PCD in ascii, binary or compressed; PLY), metres, in the file's order. Points that
/// are not finite, or further than 131 km from the origin, are dropped and counted ("cloud.nan_points",
/// "cloud.far_points"). Throws InputError, naming the file, where it is missing, of another kind, malformed, without x,
/// y, z, holds no points, has most of them so far from the origin that floats do not tell them apart, or is a text of
/// more points than PCL can count.
std::vector<Eigen::Vector3f> read_point_cloud(const std::string& path, WarningLog& warnings);

using PointSink = std::function<void(std::span<const Eigen::Vector3f>)>;

/// The same, piece by piece: of an uncompressed binary PCD, however large, only a piece is in memory. Other kinds of
/// files are read whole first.
void stream_point_cloud(const std::string& path, WarningLog& warnings, const PointSink& sink);

/// Writes positions as a binary PCD, aside and renamed. Throws InputError.
void write_point_cloud(const std::string& path, const std::vector<Eigen::Vector3f>& points);

}  // namespace lodestone

#pragma once

#include <string>

#include "core/geometry/trajectory.h"

/// KITTI's format: one pose in each line, twelve numbers: the upper three rows of the 4×4 matrix T_map_imu, row by row.
/// Times are in another file, with one stamp in seconds in each line.
namespace lodestone {

/// Whether the first line with values has twelve numbers between spaces. `text`: of the file.
bool is_kitti_text(const std::string& text);
/// The same for a file; false if it cannot be read.
bool is_kitti_file(const std::string& path);

/// Throws InputError, with file and line, for a malformed line, a matrix that is no rotation, a decreasing stamp, or
/// another number of stamps than poses.
Trajectory read_kitti(const std::string& path, const std::string& times);

/// The text of such a file: nine significant digits.
std::string kitti_text(const Trajectory& trajectory);
/// The text of the file with the times: nine decimals.
std::string kitti_times_text(const Trajectory& trajectory);

}  // namespace lodestone

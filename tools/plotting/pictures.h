#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/geometry/trajectory.h"
#include "core/magnetometer/magnetic_map.h"

namespace lodestone {

/// One estimator's part of the pictures.
struct PictureSeries {
  std::string name;
  Trajectory trajectory;                   ///< T_map_imu
  std::vector<double> error_time_s;        ///< since the log's begin
  std::vector<double> error_m;             ///< position error at these times
  std::vector<double> step_time_s;         ///< since the log's begin, one a scan
  std::vector<int> degenerate_directions;  ///< one a scan
  std::vector<double> magnetic_weight;     ///< one a scan, 0 to 1; empty for an estimator without magnetometers
};

/// The magnetic map's |B| in colour (none where `map` is null) with the truth and every estimate over it, to one scale.
void draw_map_picture(const std::filesystem::path& path, const MagneticMap* map, const Trajectory& truth,
                      const std::vector<PictureSeries>& series);

/// Position error over time; stretches that the first series calls degenerate shaded; its number of degenerate
/// directions and all magnetic weights below.
void draw_error_picture(const std::filesystem::path& path, const std::vector<PictureSeries>& series);

/// The share of scans within an error, over that error.
void draw_distribution_picture(const std::filesystem::path& path, const std::vector<PictureSeries>& series);

}  // namespace lodestone

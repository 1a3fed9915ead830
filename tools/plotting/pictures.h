#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/geometry/trajectory.h"
#include "core/magnetometer/magnetic_map.h"
#include "tools/plotting/canvas.h"

namespace lodestone {

/// The data of one estimator for the pictures.
struct PictureSeries {
  std::string name;
  Trajectory trajectory;                   ///< T_map_imu
  std::vector<double> error_time_s;        ///< since the log's begin, one per scan with ground truth
  std::vector<double> error_m;             ///< position error at these times; nan if the estimator was lost
  std::vector<double> step_time_s;         ///< since the log's begin, one per scan
  std::vector<int> degenerate_directions;  ///< one per scan
  std::vector<double> magnetic_weight;     ///< one per scan, 0 to 1; empty for an estimator without magnetometers
};

/// One colour per series, by its name as in all figures.
std::vector<Color> colors_of(const std::vector<PictureSeries>& series);

/// The magnetic map's |B| in colour (without map: none) with ground truth and estimates, to scale.
void draw_map_picture(const std::filesystem::path& path, const MagneticMap* map, const Trajectory& truth,
                      const std::vector<PictureSeries>& series);

/// Position error over time, with shaded intervals in which the first series is degenerate. Below: its number of
/// degenerate directions, and all magnetic weights.
void draw_error_picture(const std::filesystem::path& path, const std::vector<PictureSeries>& series);

/// Cumulative distribution of the error over all scans. Lost scans count as beyond every error.
void draw_distribution_picture(const std::filesystem::path& path, const std::vector<PictureSeries>& series);

}  // namespace lodestone

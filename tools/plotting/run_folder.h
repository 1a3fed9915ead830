#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "core/geometry/trajectory.h"

/// The figures of a paper, drawn from what runs leave in their folders: logs and maps may be gone by then. Every figure
/// takes plain data and the path it is saved under, with the extension .png, .pdf or .svg, or without for all three.
/// Sizes are those of a two-column page. docs/user/figures.md shows them.
namespace lodestone::figures {

/// The errors of one method over one log.
struct ErrorSeries {
  std::string method;           ///< as `run --estimator` calls it
  std::vector<double> time_s;   ///< since the series' first scan, or what the caller counts from
  std::vector<double> error_m;  ///< of the position, one a time
};

/// From one time to another, seconds.
using TimeStretch = std::pair<double, double>;

/// What the field differed from the map along a trajectory.
struct ResidualTrack {
  std::vector<double> time_s;         ///< since `begin`
  std::vector<Vector3> position;      ///< map, metres
  std::vector<double> difference_ut;  ///< |measured − map|
};

/// The readers below take DIR/NAME, the folder of one estimator of `lodestone run`. Times become seconds since `begin`;
/// `begin_of` gives the first scan's, so that all methods of one log count from the same moment.
/// They throw InputError, naming file and line, where a file is missing or malformed.

/// The first scan's time, of diagnostics.csv.
Time begin_of(const std::filesystem::path& folder);

/// errors.csv; the method is the folder's name.
ErrorSeries read_error_series(const std::filesystem::path& folder, Time begin);

/// The stretches of scans, of diagnostics.csv, with a direction that LiDAR did not see. Those nearer to each other than
/// `join_s` become one; of these, those shorter than `least_s` are left out.
std::vector<TimeStretch> read_degenerate_stretches(const std::filesystem::path& folder, Time begin, double join_s = 1.0,
                                                   double least_s = 0.5);

/// field_residuals.csv.
ResidualTrack read_residuals(const std::filesystem::path& folder, Time begin);

/// The positions of trajectory.tum.
std::vector<Vector3> read_track(const std::filesystem::path& folder);

}  // namespace lodestone::figures

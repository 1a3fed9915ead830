#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "core/geometry/trajectory.h"

/// Figures for papers, drawn from the files of run folders; logs and maps are not required. A figure's function gets
/// plain data and the path of the file, with the extension .png, .pdf or .svg, or without for all three. Sizes are
/// those of a two-column page (docs/user/figures.md).
namespace lodestone::figures {

/// The errors of one method over one log.
struct ErrorSeries {
  std::string method;           ///< name for `run --estimator`
  std::vector<double> time_s;   ///< since the series' first scan, or another reference
  std::vector<double> error_m;  ///< of the position, one per time
};

/// Begin and end, seconds.
using TimeInterval = std::pair<double, double>;

/// Differences of the measured field from the map along a trajectory.
struct ResidualTrack {
  std::vector<double> time_s;         ///< since `begin`
  std::vector<Vector3> position;      ///< map, metres
  std::vector<double> difference_ut;  ///< |measured − map|
};

/// The readers below require DIR/NAME, the folder of one estimator of `lodestone run`. Times are seconds since `begin`.
/// `begin_of` gives the first scan's time, a common reference for all methods of a log. The readers throw InputError
/// with file and line if a file is missing or malformed.

/// The first scan's time, from diagnostics.csv.
Time begin_of(const std::filesystem::path& folder);

/// errors.csv; the method is the folder's name.
ErrorSeries read_error_series(const std::filesystem::path& folder, Time begin);

/// Intervals of scans with a degenerate direction, from diagnostics.csv. Intervals closer than 1 s are joined; then
/// intervals shorter than 0.5 s are dropped.
std::vector<TimeInterval> read_degenerate_stretches(const std::filesystem::path& folder, Time begin);

/// field_residuals.csv.
ResidualTrack read_residuals(const std::filesystem::path& folder, Time begin);

/// The positions of trajectory.tum.
std::vector<Vector3> read_track(const std::filesystem::path& folder);

}  // namespace lodestone::figures

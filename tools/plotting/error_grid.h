#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tools/plotting/run_folder.h"

namespace lodestone::figures {

/// Several methods on one log.
struct ErrorPanel {
  std::vector<ErrorSeries> series;
  std::vector<TimeInterval> degenerate;  ///< shaded in the panel
};

struct ErrorGrid {
  std::vector<std::string> rows;     ///< headings, e.g. "noise 1 µT"
  std::vector<std::string> columns;  ///< headings, e.g. "range 100 m"
  std::vector<ErrorPanel> panels;    ///< row by row; a panel without series stays empty
  double window_s = 1.0;
};

/// The error over time, one panel per case: for every method, the mean over a window with a band of one standard
/// deviation. All panels have the same error axis; panels of a column have the same time axis. If errors span decades,
/// the error axis is logarithmic. Throws std::invalid_argument unless there are rows × columns panels.
void draw_error_grid(const std::filesystem::path& path, const ErrorGrid& grid);

}  // namespace lodestone::figures

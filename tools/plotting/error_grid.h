#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tools/plotting/run_folder.h"

namespace lodestone::figures {

/// One case: several methods over one log.
struct ErrorPanel {
  std::vector<ErrorSeries> series;
  std::vector<TimeStretch> degenerate;  ///< shaded
};

struct ErrorGrid {
  std::vector<std::string> rows;     ///< headings, e.g. "noise 1 µT"
  std::vector<std::string> columns;  ///< headings, e.g. "range 100 m"
  std::vector<ErrorPanel> panels;    ///< row by row; one without series stays empty
  double window_s = 1.0;
};

/// The error over time, a panel a case: for every method alike the mean over a window, with a band of one standard
/// deviation within it. All panels share the error's axis, all of a column the time's; where errors span decades
/// the axis is logarithmic. One legend for all. Throws std::invalid_argument where there are not rows × columns panels.
void draw_error_grid(const std::filesystem::path& path, const ErrorGrid& grid);

}  // namespace lodestone::figures

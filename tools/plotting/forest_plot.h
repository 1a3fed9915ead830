#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/evaluation/paired_ratio.h"

namespace lodestone::figures {

/// One case, compared with the common reference.
struct ForestRow {
  std::string label;
  std::vector<double> ratios;             ///< of single pairs, as small points
  std::optional<RatioEstimate> estimate;  ///< of all pairs; nothing: `note` is shown instead
  std::string note;                       ///< to the right of the row's numbers, e.g. "2 lost"
};

struct ForestPlot {
  std::string axis;  ///< title of the axis
  std::vector<ForestRow> rows;
};

/// Ratios with their confidence intervals, one per row, on a logarithmic axis with a line at 1; smaller is better. The
/// numbers are at the right. An arrow at the end of the axis marks values beyond the axis.
void draw_forest_plot(const std::filesystem::path& path, const ForestPlot& plot);

/// Round ratios between `low` and `high`, both positive, including 1 if in range. Narrow ranges have closer ratios.
std::vector<double> ratio_ticks(double low, double high);

}  // namespace lodestone::figures

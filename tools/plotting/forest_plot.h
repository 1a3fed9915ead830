#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/evaluation/paired_ratio.h"

namespace lodestone::figures {

/// One thing that is compared with what all rows are compared with.
struct ForestRow {
  std::string label;
  std::vector<double> ratios;             ///< of single pairs, drawn small
  std::optional<RatioEstimate> estimate;  ///< of all of them; nothing: `note` stands in its place
  std::string note;                       ///< to the right of the row's numbers, e.g. "2 lost"
};

struct ForestPlot {
  std::string axis;  ///< what the ratios are of
  std::vector<ForestRow> rows;
};

/// Ratios with their confidence intervals, a row each, on a logarithmic axis with a line at 1: left of it is better.
/// The numbers stand at the right. What lies beyond the axis is marked by an arrow at its end.
void draw_forest_plot(const std::filesystem::path& path, const ForestPlot& plot);

/// Round ratios within `low` to `high`, both above 0, 1 among them where it is: close ones where the range is narrow.
std::vector<double> ratio_ticks(double low, double high);

}  // namespace lodestone::figures

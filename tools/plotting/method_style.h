#pragma once

#include <string>
#include <vector>

#include "tools/plotting/axes.h"

namespace lodestone::figures {

/// Style of a method, the same in all figures.
struct MethodStyle {
  std::string label;
  Color color;
  Stroke stroke = Stroke::solid;
  double width = 2.0;
};

/// Indices for series_color, one per method, in the order of `methods`. Estimators of the program always have the same
/// colour; others get the remaining colours.
std::vector<std::size_t> method_colors(const std::vector<std::string>& methods);

/// One style per method, in the order of `methods`. Estimators of the program always have the same style.
std::vector<MethodStyle> method_styles(const std::vector<std::string>& methods);

/// The names in the order of a legend, each once.
std::vector<std::string> legend_order(std::vector<std::string> methods);

}  // namespace lodestone::figures

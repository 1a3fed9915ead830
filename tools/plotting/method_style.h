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

/// One style per method, in the order of `methods`. Well-known estimators always have the same style; others get the
/// remaining colours.
std::vector<MethodStyle> method_styles(const std::vector<std::string>& methods);

/// The names in the order of a legend, each once.
std::vector<std::string> legend_order(std::vector<std::string> methods);

}  // namespace lodestone::figures

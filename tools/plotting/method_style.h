#pragma once

#include <string>
#include <vector>

#include "tools/plotting/axes.h"

namespace lodestone::figures {

/// How a method looks, in every figure alike.
struct MethodStyle {
  std::string label;
  Color color;
  Stroke stroke = Stroke::solid;
  double width = 2.0;
};

/// A style a method, in the order of `methods`. Well-known estimators look the same whoever is with them; others take
/// the colours that are left.
std::vector<MethodStyle> method_styles(const std::vector<std::string>& methods);

/// The names in the order in which they should stand in a legend, each once.
std::vector<std::string> legend_order(std::vector<std::string> methods);

}  // namespace lodestone::figures

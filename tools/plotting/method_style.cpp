#include "tools/plotting/method_style.h"

#include <algorithm>
#include <array>

namespace lodestone::figures {

namespace {

struct Known {
  const char* name;
  std::size_t color;
  Stroke stroke;
};

/// In the legend's order. Strokes differ too, for print in grey.
constexpr std::array<Known, 10> kKnown{{{"smoother", 0, Stroke::solid},
                                        {"ieskf", 1, Stroke::dashed},
                                        {"lidar-inertial", 2, Stroke::solid},
                                        {"magnetic", 3, Stroke::dotted},
                                        {"ndt", 4, Stroke::solid},
                                        {"continuous-time", 5, Stroke::dashed},
                                        {"magnetic-calibrating", 6, Stroke::dotted},
                                        {"magnetic-particle", 7, Stroke::dashed},
                                        {"magnetic-stochastic", 8, Stroke::dotted},
                                        {"magnetic-mixture", 9, Stroke::solid}}};

const Known* find_known(const std::string& method) {
  const auto* found =
      std::find_if(kKnown.begin(), kKnown.end(), [&](const Known& known) { return known.name == method; });
  return found == kKnown.end() ? nullptr : found;
}

}  // namespace

std::vector<std::size_t> method_colors(const std::vector<std::string>& methods) {
  std::vector<std::size_t> colors;
  std::size_t next = kKnown.size();
  for (const std::string& method : methods) {
    const Known* known = find_known(method);
    colors.push_back(known != nullptr ? known->color : next++);
  }
  return colors;
}

std::vector<MethodStyle> method_styles(const std::vector<std::string>& methods) {
  const std::vector<std::size_t> colors = method_colors(methods);
  std::vector<MethodStyle> styles;
  for (std::size_t i = 0; i < methods.size(); ++i) {
    const Known* known = find_known(methods[i]);
    styles.push_back({methods[i], series_color(colors[i]), known != nullptr ? known->stroke : Stroke::solid});
  }
  return styles;
}

std::vector<std::string> legend_order(std::vector<std::string> methods) {
  std::vector<std::string> unique;
  for (std::string& method : methods) {
    if (std::find(unique.begin(), unique.end(), method) == unique.end()) unique.push_back(std::move(method));
  }
  std::stable_sort(unique.begin(), unique.end(), [](const std::string& a, const std::string& b) {
    const auto place = [](const std::string& name) {
      const Known* known = find_known(name);
      return known == nullptr ? kKnown.size() : static_cast<std::size_t>(known - kKnown.data());
    };
    return place(a) < place(b);
  });
  return unique;
}

}  // namespace lodestone::figures

#include <algorithm>
#include <array>
#include <cmath>

#include "tools/pictures/canvas.h"

namespace lodestone {

Color series_color(std::size_t index) {
  static constexpr std::array<Color, 7> kColors{{{213, 94, 0},
                                                 {0, 114, 178},
                                                 {0, 158, 115},
                                                 {204, 121, 167},
                                                 {230, 159, 0},
                                                 {86, 180, 233},
                                                 {120, 94, 60}}};
  return kColors[index % kColors.size()];
}

Color heat_color(double share) {
  // Viridis at eight even steps (Smith and van der Walt 2015).
  static constexpr std::array<std::array<double, 3>, 8> kSteps{{{68, 1, 84},
                                                                {70, 50, 127},
                                                                {54, 92, 141},
                                                                {39, 127, 142},
                                                                {31, 161, 135},
                                                                {74, 194, 109},
                                                                {159, 218, 58},
                                                                {253, 231, 37}}};
  constexpr double kPaling = 0.4;
  const double place = std::clamp(share, 0.0, 1.0) * (kSteps.size() - 1);
  const auto low = std::min(static_cast<std::size_t>(place), kSteps.size() - 2);
  const double part = place - static_cast<double>(low);
  std::array<int, 3> mixed{};
  for (std::size_t i = 0; i < 3; ++i) {
    const double value = kSteps[low][i] * (1.0 - part) + kSteps[low + 1][i] * part;
    mixed[i] = static_cast<int>(std::lround(value * (1.0 - kPaling) + 255.0 * kPaling));
  }
  return {mixed[0], mixed[1], mixed[2]};
}

}  // namespace lodestone

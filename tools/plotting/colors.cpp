#include <algorithm>
#include <array>
#include <cmath>

#include "tools/plotting/canvas.h"

namespace lodestone {

namespace {

/// Between colours at even steps from 0 to 1; `paling` mixes in so much white.
template <std::size_t N>
Color between(const std::array<std::array<double, 3>, N>& steps, double share, double paling = 0.0) {
  const double place = std::clamp(share, 0.0, 1.0) * (N - 1);
  const auto low = std::min(static_cast<std::size_t>(place), N - 2);
  const double part = place - static_cast<double>(low);
  std::array<int, 3> mixed{};
  for (std::size_t i = 0; i < 3; ++i) {
    const double value = steps[low][i] * (1.0 - part) + steps[low + 1][i] * part;
    mixed[i] = static_cast<int>(std::lround(value * (1.0 - paling) + 255.0 * paling));
  }
  return {mixed[0], mixed[1], mixed[2]};
}

}  // namespace

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
  return between(kSteps, share, 0.4);
}

Color difference_color(double share) {
  // Oranges to reds at seven even steps (ColorBrewer's OrRd, its first step white).
  static constexpr std::array<std::array<double, 3>, 7> kSteps{
      {{255, 255, 255}, {254, 232, 200}, {253, 187, 132}, {252, 141, 89}, {227, 74, 51}, {179, 0, 0}, {100, 0, 20}}};
  return between(kSteps, share);
}

Color grey_color(double share) {
  static constexpr std::array<std::array<double, 3>, 2> kSteps{{{250, 250, 250}, {90, 90, 90}}};
  return between(kSteps, share);
}

Color vivid_color(double share) {
  // Plasma at six even steps (Smith and van der Walt 2015).
  static constexpr std::array<std::array<double, 3>, 6> kSteps{
      {{13, 8, 135}, {106, 0, 168}, {177, 42, 144}, {225, 100, 98}, {252, 166, 54}, {240, 249, 33}}};
  return between(kSteps, share);
}

}  // namespace lodestone

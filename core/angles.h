#pragma once

#include <numbers>

namespace lodestone {

inline constexpr double degree = std::numbers::pi / 180.0;  ///< in radians
inline constexpr double degrees_per_radian = 180.0 / std::numbers::pi;

}  // namespace lodestone

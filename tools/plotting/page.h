#pragma once

namespace lodestone::figures {

inline constexpr double kPageWidth = 1032.0;  ///< of a figure over both columns

}  // namespace lodestone::figures

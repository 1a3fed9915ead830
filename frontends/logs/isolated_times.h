#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "core/time.h"

namespace lodestone {

/// Indexes of record times that are damaged: more than a minute away from both neighbours, while these are at most ten
/// seconds apart. At the first and the last time, which have neighbours on one side only: more than a day away.
/// `times` are in the order of writing. A jump of the recorder's clock is not isolated, since later times follow it.
std::vector<std::size_t> isolated_times(std::span<const Time> times);

}  // namespace lodestone

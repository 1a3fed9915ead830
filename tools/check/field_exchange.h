#pragma once

#include <cstddef>
#include <vector>

#include "tools/check/field_series.h"

namespace lodestone {

/// Which of the mounts' fields each magnetometer's readings follow: its own, but for those that were exchanged (topics,
/// plugs) in pairs or in a ring. One of these differs from the map by more than 0.8 µT as it is named and by less than
/// 0.7 of that in the other's place, and so do all of its ring; a sensor that is turned or stretched may fit another's
/// place better, but the other does not fit its own. `all`: one a magnetometer; those without readings follow their
/// own.
std::vector<std::size_t> mounts_followed(const std::vector<FieldSeries>& all);

/// What a mount should have read against what another magnetometer did, at the times of both.
FieldSeries exchanged(const FieldSeries& mount, const FieldSeries& readings);

}  // namespace lodestone

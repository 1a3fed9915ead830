#pragma once

#include <cstddef>
#include <vector>

#include "tools/check/field_series.h"

namespace lodestone {

/// For each magnetometer, the mount whose field its readings match: its own, unless topics or plugs are exchanged in
/// pairs or in a ring. In an exchange, every magnetometer of the ring differs from its own mount's field by more than
/// 0.8 µT, and from the other's by less than 0.7 of that. A rotated or stretched sensor may match another mount better,
/// but the other sensor does not match its own. `all`: one per magnetometer; without readings, the own mount.
std::vector<std::size_t> match_mounts(const std::vector<FieldSeries>& all);

/// The expected field of a mount and the readings of another magnetometer, at common times.
FieldSeries exchanged(const FieldSeries& mount, const FieldSeries& readings);

}  // namespace lodestone

#pragma once

#include <set>

#include "core/evaluation/field_comparison.h"
#include "frontends/configuration/platform.h"
#include "tools/check/finding.h"

namespace lodestone {

/// The magnetometers against the magnetic map along a drive: hard iron, a turned or stretched sensor, drift, late
/// stamps, steel that passes, and a map that does not fit at all. Magnetometers in `known` are known to be broken: left
/// out.
Findings check_field_along(const FieldComparison& comparison, const Platform& platform,
                           const std::set<std::size_t>& known);

}  // namespace lodestone

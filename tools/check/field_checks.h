#pragma once

#include <set>

#include "core/evaluation/field_comparison.h"
#include "frontends/configuration/platform.h"
#include "tools/check/finding.h"

namespace lodestone {

/// Compares the magnetometers with the magnetic map along a path: hard iron, rotated or stretched sensors, drift, late
/// stamps, passing steel, and a map that does not fit at all. `known`: magnetometers already found faulty; ignored.
Findings check_field_along(const FieldComparison& comparison, const Platform& platform,
                           const std::set<std::size_t>& known);

}  // namespace lodestone

#pragma once

#include "core/evaluation/field_comparison.h"
#include "frontends/checks/finding.h"
#include "frontends/readers/platform.h"

namespace lodestone {

/// The magnetometers against the magnetic map along a drive: hard iron, a turned or stretched sensor, drift, late stamps,
/// steel that passes, and a map that does not fit at all.
Findings check_field_along(const FieldComparison& comparison, const Platform& platform);

}  // namespace lodestone

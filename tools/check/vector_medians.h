#pragma once

#include <span>

#include "core/geometry/so3.h"

namespace lodestone {

/// The median of each component; `vectors` must not be empty.
Vector3 component_medians(std::span<const Vector3> vectors);

/// The median of the lengths; 0 if `vectors` is empty.
double median_length(std::span<const Vector3> vectors);

}  // namespace lodestone

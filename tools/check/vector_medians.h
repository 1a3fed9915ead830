#pragma once

#include <span>

#include "core/geometry/so3.h"

namespace lodestone {

/// Each component's median; `vectors` must not be empty.
Vector3 component_medians(std::span<const Vector3> vectors);

/// The median of their lengths; 0 where there are none.
double median_length(std::span<const Vector3> vectors);

}  // namespace lodestone

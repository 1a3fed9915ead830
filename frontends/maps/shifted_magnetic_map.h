#pragma once

#include <string>

#include "core/geometry/so3.h"

namespace lodestone {

/// Copies a magnetic map with `shift_m` (x, y, z) added to the positions of its nodes; the field stays as it is. The
/// provenance is kept, with a line about the shift. Throws InputError as read_magnetic_map and write_magnetic_map.
void shift_magnetic_map(const std::string& from_yaml, const std::string& to_yaml, const Vector3& shift_m);

}  // namespace lodestone

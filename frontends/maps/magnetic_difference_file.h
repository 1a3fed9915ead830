#pragma once

#include <string>

#include "core/magnetometer/magnetic_difference.h"

namespace lodestone {

/// Writes a difference of two magnetic maps in the format of magnetic maps: `yaml_path`, and a .tif of the same name
/// with the pages ΔB_x, ΔB_y, ΔB_z, |ΔB| (µT) of each layer; NaN where nothing was compared. `first`, `second`: names
/// of the maps' files. Throws InputError if this fails.
void write_magnetic_difference(const MagneticDifference& difference, const std::string& first,
                               const std::string& second, const std::string& yaml_path);

}  // namespace lodestone

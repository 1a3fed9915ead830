#pragma once

#include <string>

#include "core/magnetometer/magnetic_difference.h"

namespace lodestone {

/// Writes a difference of two magnetic maps as a raster beside its description, laid out as magnetic maps are:
/// `yaml_path` and the same name with .tif, whose pages are ΔB_x, ΔB_y, ΔB_z, |ΔB| (µT) of each layer; NaN where
/// nothing was compared. `first`, `second`: the maps' files, for people. Throws InputError where that fails.
void write_magnetic_difference(const MagneticDifference& difference, const std::string& first,
                               const std::string& second, const std::string& yaml_path);

}  // namespace lodestone

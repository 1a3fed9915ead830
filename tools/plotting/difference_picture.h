#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/magnetometer/magnetic_difference.h"
#include "tools/map/changed_places.h"

namespace lodestone {

/// |ΔB| of two magnetic maps in colour, to scale, with its colour bar: the largest change ringed and named, and the ten
/// largest places above the threshold numbered as in their table. `title`: what was compared.
void draw_difference_picture(const std::filesystem::path& path, const MagneticDifference& difference,
                             const std::vector<ChangedPlace>& places, const std::string& title);

}  // namespace lodestone

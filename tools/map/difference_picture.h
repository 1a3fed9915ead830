#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/magnetometer/magnetic_difference.h"
#include "tools/map/changed_places.h"

namespace lodestone {

/// |ΔB| of two magnetic maps in colour, to scale, with a colour bar. The largest change has a ring and a text; the ten
/// largest places above the threshold have their numbers of the table. `title`: the compared maps.
void draw_difference_picture(const std::filesystem::path& path, const MagneticDifference& difference,
                             const std::vector<ChangedPlace>& places, const std::string& title);

}  // namespace lodestone

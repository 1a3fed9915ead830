#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/evaluation/stale_map.h"
#include "core/magnetometer/magnetic_map.h"

namespace lodestone {

/// A point of the drive with the difference of the field from the map.
struct DifferencePoint {
  Vector3 position = Vector3::Zero();  ///< map, metres
  double size_ut = 0.0;                ///< |measured − map|
};

/// The map's |B| in pale grey, the drive coloured by |measured − map|, stale cells hatched with a frame, and the number
/// of each stale place. `estimator`: whose poses the readings have. `drive` in order of time.
void draw_stale_map_picture(const std::filesystem::path& path, const std::string& estimator, const MagneticMap& map,
                            const std::vector<DifferencePoint>& drive, const StaleMap& stale);

}  // namespace lodestone

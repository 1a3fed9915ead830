#pragma once

#include <memory>
#include <string>

#include "core/lidar/plane_map.h"
#include "core/magnetometer/magnetic_map.h"
#include "tools/simulate/simulation_source.h"

namespace lodestone {

/// Maps of the benchmark's robots.
struct SiteMaps {
  std::shared_ptr<const PlaneMap> planes;
  std::shared_ptr<const MagneticMap> field;
};

enum class MapKind {
  drives,  ///< as `lodestone simulate` and `lodestone map magnetic` make them: seen from, and surveyed along, the
           ///< world's drives
  site     ///< of the whole floor: seen from 300 places all over it, the field wherever a robot can stand
};

/// Made anew, or read from `folder` if an earlier call wrote them there; with an empty `folder`, nothing is written.
/// The field of a site is the true one plus an error of 0.5 µT, constant over 0.4 m; that of drives is regressed from
/// surveys.
SiteMaps make_maps(const simulation::World& world, std::shared_ptr<const simulation::Environment> environment,
                   MapKind kind, const std::string& folder);

}  // namespace lodestone

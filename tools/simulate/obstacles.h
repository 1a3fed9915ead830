#pragma once

#include <vector>

#include "tools/simulate/motion.h"
#include "tools/simulate/ray_caster.h"

namespace lodestone::simulation {

/// A place where a robot passes through a surface.
struct Obstacle {
  double seconds = 0.0;                ///< since the start
  Vector3 position = Vector3::Zero();  ///< of the IMU, map, m
};

/// Where the IMU passes through surfaces, glass included: what is met within 5 s is one obstacle, as both sides of a
/// wall or of a box.
std::vector<Obstacle> obstacles_on_path(const Motion& motion, const RayCaster& caster);

}  // namespace lodestone::simulation

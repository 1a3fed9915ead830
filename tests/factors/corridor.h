#pragma once

#include "core/observability/degeneracy.h"

namespace lodestone {

/// Masks the direction along a corridor.
inline Matrix6 corridor_projector() {
  Vector6 information;
  information << 1e6, 1e6, 1e6, 0.0, 1e6, 1e6;
  // Slightly rotated, so that the masked direction couples rotation and translation.
  Matrix6 turn = Matrix6::Identity();
  turn(3, 2) = 0.1;
  turn(2, 3) = -0.1;
  return analyse_by_sigma(turn.transpose() * Matrix6(information.asDiagonal()) * turn, 4.0, {}).lidar_projector();
}

}  // namespace lodestone

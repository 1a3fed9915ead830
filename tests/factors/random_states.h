#pragma once

#include <random>

#include "core/geometry/pose.h"
#include "core/observability/degeneracy.h"

namespace lodestone {

/// Random values of unit variance.
class RandomStates {
 public:
  explicit RandomStates(std::uint64_t seed) : generator_(seed) {}
  double normal() { return normal_(generator_); }
  Vector3 vector(double scale = 1.0) { return scale * Vector3(normal(), normal(), normal()); }
  Pose pose(double position_scale = 1.0) { return {so3::exp(vector()), vector(position_scale)}; }

 private:
  std::mt19937_64 generator_;
  std::normal_distribution<double> normal_;
};

/// Hides the way along a corridor.
inline Matrix6 corridor_projector() {
  Vector6 information;
  information << 1e6, 1e6, 1e6, 0.0, 1e6, 1e6;
  // Turned a little, so that the hidden direction couples rotation and translation.
  Matrix6 turn = Matrix6::Identity();
  turn(3, 2) = 0.1;
  turn(2, 3) = -0.1;
  return analyse_by_sigma(turn.transpose() * Matrix6(information.asDiagonal()) * turn, 4.0, {}).lidar_projector();
}

}  // namespace lodestone

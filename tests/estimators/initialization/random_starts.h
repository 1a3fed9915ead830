#pragma once

#include <cstdint>
#include <vector>

#include "tools/simulate/simulation_source.h"

namespace lodestone::simulation {

/// Options of random starts.
struct RandomStarts {
  int count = 200;
  std::uint64_t seed = 1;
  double moving_share = 0.5;     ///< share of robots that drive when the log begins; the others stand
  double robot_radius_m = 0.45;  ///< free radius around a place
  double head_room_m = 2.0;
  double speed_m_s = 1.0;
};

/// A drive that starts at a random pose.
struct RandomStart {
  Sequence sequence;
  double skip_s = 0.0;  ///< start of the log after the start of the drive, so that a driving robot has its speed
};

/// Start positions are uniform over all floor (map z = 0) on which a robot can stand; headings are uniform. Driving
/// robots follow a curved free path of 6 m. Deterministic by seed. Returns fewer than `count` starts if the world has
/// hardly any free floor.
std::vector<RandomStart> random_starts(const Environment& environment, const RandomStarts& options);

/// A copy of the world with one more sequence, called `name`.
World with_sequence(World world, const std::string& name, const Sequence& sequence);

}  // namespace lodestone::simulation

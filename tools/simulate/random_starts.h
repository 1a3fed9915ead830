#pragma once

#include <cstdint>
#include <vector>

#include "tools/simulate/simulation_source.h"

namespace lodestone::simulation {

/// What random starts are like.
struct RandomStarts {
  int count = 200;
  std::uint64_t seed = 1;
  double moving_share = 0.5;     ///< of the robots drive when the log begins; the others stand
  double robot_radius_m = 0.45;  ///< nothing stands so near to a place
  double head_room_m = 2.0;
  double speed_m_s = 1.0;
};

/// A drive that begins anywhere.
struct RandomStart {
  Sequence sequence;
  double skip_s = 0.0;  ///< the log begins so long after the drive: a robot is then under way
};

/// Places drawn evenly over all floor (map z = 0) on which a robot can stand, with headings drawn evenly; those that
/// drive go 6 m along a bent free path. Deterministic by seed. Fewer than `count` where the world has next to no free
/// floor.
std::vector<RandomStart> random_starts(const Environment& environment, const RandomStarts& options);

/// The world with one further sequence, called `name`.
World with_sequence(World world, const std::string& name, const Sequence& sequence);

}  // namespace lodestone::simulation

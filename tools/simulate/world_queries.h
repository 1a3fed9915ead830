#pragma once

#include <string>
#include <vector>

#include "tools/simulate/reality_grade.h"

namespace lodestone::simulation {

/// White noise of a world's magnetometers, per axis, µT. `assignments` are "key.path=value", as for load_world().
/// Throws InputError like load_world().
double magnetometer_noise_ut(const std::string& world_file, const std::vector<std::string>& assignments = {});

/// Throws InputError if the world cannot be read, or if it lacks the sequence or one of the scenes.
void require_in_world(const std::string& world_file, const std::vector<std::string>& assignments,
                      const std::string& sequence, const std::vector<std::string>& scenes);

}  // namespace lodestone::simulation

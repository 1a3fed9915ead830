#pragma once

#include <string>

#include "tools/simulate/moved_objects.h"
#include "tools/simulate/simulation_source.h"

namespace lodestone::simulation {

/// Text of reality.yaml: grade, seed, every key of the section `reality`, and all values drawn for `drive`, with units
/// in the names. Tests compare an estimated calibration with this file; no estimator reads it.
std::string reality_yaml(const World& world, const MovedObjects& moved, const SimulationSource& drive);

}  // namespace lodestone::simulation

#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/geometry/trajectory.h"
#include "tools/simulate/simulation_source.h"

namespace lodestone::simulation {

/// The prior point-cloud map, made as a surveyor would: every surface that a scanner sees from places along the
/// sequences' paths, sampled at random with CloudOptions::point_spacing_m (one point per spacing²), with isotropic
/// noise. Of glass, and of what is seen through glass only, as few points as beams come back. Some surfaces are mapped
/// twice, and all is displaced, as the world's section `reality` and `seed` say. Map frame. Deterministic by `seed` on
/// any number of threads.
std::vector<Eigen::Vector3f> sample_cloud(const World& world, const Environment& environment, std::uint64_t seed);

}  // namespace lodestone::simulation

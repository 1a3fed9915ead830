#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/geometry/trajectory.h"
#include "tools/simulate/simulation_source.h"

namespace lodestone::simulation {

/// The prior point-cloud map, as a surveyor would make it: every surface that a scanner sees from viewpoints along the
/// sequences' paths, sampled at random (one point per CloudOptions::point_spacing_m²), with isotropic noise. On and
/// behind glass, the density of points is reduced to the share of beams that return. The world's section `reality` and
/// `seed` determine which surfaces are mapped twice and how the map is displaced. Map frame. Deterministic by `seed` on
/// any number of threads.
std::vector<Eigen::Vector3f> sample_cloud(const World& world, const Environment& environment, std::uint64_t seed);

}  // namespace lodestone::simulation

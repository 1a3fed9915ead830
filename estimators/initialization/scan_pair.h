#pragma once

#include <span>

#include "estimators/factory.h"

namespace lodestone {

/// The states at the ends of two scans.
struct PairMotion {
  NavState first;
  NavState second;
};

/// The motion with which two scans fit the map best, on a grid of horizontal velocities. Where scans are rare, an
/// unknown velocity moves the robot between two of them further than a registration converges: 0.7 m within half a
/// second (docs/design/071-starts-of-rare-scans.md). `bundles`: the first and the last have points; those between add
/// their IMU. `state`: at the end of the first scan, whose pose was found with this velocity. `sigma_m_s`: of the
/// velocity, each axis.
PairMotion find_motion(std::span<const ScanBundle> bundles, const NavState& state, double sigma_m_s,
                       const EstimatorInput& input);

}  // namespace lodestone

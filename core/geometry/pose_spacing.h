#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "core/geometry/trajectory.h"
#include "core/middle_value.h"

namespace lodestone {

/// Median time between neighbouring poses, ns; 0 with fewer than two poses.
inline Time pose_spacing(const Trajectory& trajectory) {
  std::vector<Time> spacings;
  for (std::size_t i = 1; i < trajectory.size(); ++i) {
    spacings.push_back(trajectory[i].time - trajectory[i - 1].time);
  }
  return spacings.empty() ? 0 : middle_value(std::move(spacings));
}

}  // namespace lodestone

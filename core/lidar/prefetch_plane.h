#pragma once

#include <cstddef>
#include <span>

#include "core/lidar/correspondence.h"

namespace lodestone {

/// Begins to read the plane of a correspondence a few places after `i`: the planes of a scan lie all over the map's
/// memory.
inline void prefetch_plane(std::span<const Correspondence> correspondences, std::size_t i) {
  constexpr std::size_t kAhead = 12;
  if (i + kAhead >= correspondences.size()) return;
  const auto* plane = reinterpret_cast<const char*>(correspondences[i + kAhead].plane);
  __builtin_prefetch(plane);
  __builtin_prefetch(plane + sizeof(Plane) - 1);
}

}  // namespace lodestone

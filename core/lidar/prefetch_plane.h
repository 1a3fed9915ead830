#pragma once

#include <cstddef>
#include <span>

#include "core/lidar/correspondence.h"

namespace lodestone {

/// Begins to read a plane, which lies in two lines of the cache.
inline void prefetch_plane(const Plane* plane) {
  const auto* bytes = reinterpret_cast<const char*>(plane);
  __builtin_prefetch(bytes);
  __builtin_prefetch(bytes + sizeof(Plane) - 1);
}

/// The same for a correspondence a few places after `i`: the planes of a scan lie all over the map's memory.
inline void prefetch_plane(std::span<const Correspondence> correspondences, std::size_t i) {
  constexpr std::size_t kAhead = 12;
  if (i + kAhead < correspondences.size()) prefetch_plane(correspondences[i + kAhead].plane);
}

}  // namespace lodestone

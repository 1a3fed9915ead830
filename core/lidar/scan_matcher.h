#pragma once

#include <optional>
#include <span>

#include "core/geometry/pose.h"

namespace lodestone {

/// The pose at which a whole scan fits the cloud map.
struct ScanMatch {
  Pose T_map_imu;
  int points = 0;      ///< of the scan, after thinning
  int matched = 0;     ///< of these, points near a part of the map at that pose
  int iterations = 0;  ///< of the registration
};

/// Registers whole scans with the cloud map. The library that registers is hidden: estimators link no PCL.
class ScanMatcher {
 public:
  virtual ~ScanMatcher() = default;

  /// Registers `points` (imu frame, metres; finite), beginning at `guess`. The result depends on the arguments alone.
  /// Nothing if no point is near the map, or if the registration fails. Not thread-safe.
  virtual std::optional<ScanMatch> match(std::span<const Eigen::Vector3f> points, const Pose& guess) = 0;
};

}  // namespace lodestone

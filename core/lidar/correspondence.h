#pragma once

#include <span>
#include <vector>

#include "core/lidar/plane_fit.h"

namespace lodestone {

/// A point of a scan and the plane it was associated with. r = nᵀ (R p + t − q), metres.
struct Correspondence {
  Eigen::Vector3f point;       ///< p, imu frame at the scan's end
  const Plane* plane;          ///< n = plane->normal, q = plane->center, map frame; owned by the map
  float variance;              ///< m², of r: sensor and plane; the plane's error counts repeatedly (docs/design/004)
  float robust_weight = 1.0F;  ///< in (0, 1], fixed when the correspondence is found
  float age_s = 0.0F;          ///< time from the point to the scan's end
  float variance_once = 0.0F;  ///< m², of r with the plane's error counted once; 0: unknown

  float weight() const { return robust_weight / variance; }
};

}  // namespace lodestone

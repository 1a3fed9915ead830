#pragma once

#include <cstddef>
#include <span>

#include "core/geometry/so3.h"

namespace lodestone {

/// Voxels of a cloud that contain two parallel surfaces, one behind the other: a wall that was mapped twice, or a thin
/// wall seen from both sides.
struct DoubleSurfaces {
  std::size_t looked_at = 0;  ///< flat voxels with enough points
  std::size_t found = 0;      ///< number of these with two surfaces
  double distance_m = 0.0;    ///< between the two surfaces, median; 0 if none was found

  double share() const { return looked_at == 0 ? 0.0 : static_cast<double>(found) / static_cast<double>(looked_at); }
};

/// Splits each voxel's distances from its own plane where the variance between both parts is largest (Otsu, IEEE
/// Transactions on Systems, Man, and Cybernetics 1979). For one Gaussian surface this is 2/π of the variance, for an
/// evenly filled slab 3/4. Two surfaces are found if they are at least 1.5 and at most 5 cm apart, about 3.5 times
/// their own noise, and each covers the voxel. The result does not depend on the order of points.
DoubleSurfaces find_double_surfaces(std::span<const Eigen::Vector3f> points, double voxel_m);

}  // namespace lodestone

#pragma once

#include <cstddef>
#include <span>

#include "core/geometry/so3.h"

namespace lodestone {

/// Voxels of a cloud that hold two parallel surfaces one behind the other: a wall that was mapped twice, or thin walls
/// seen from both sides.
struct DoubleSurfaces {
  std::size_t looked_at = 0;  ///< voxels with enough points on something flat
  std::size_t found = 0;      ///< of them, with two surfaces
  double distance_m = 0.0;    ///< between the two, median; 0 where none was found

  double share() const { return looked_at == 0 ? 0.0 : static_cast<double>(found) / static_cast<double>(looked_at); }
};

/// Looks at each voxel's distances from its own plane and parts them where the variance between both parts is largest
/// (Otsu, IEEE Transactions on Systems, Man, and Cybernetics 1979). Of one Gaussian surface that is 2/π of the
/// variance, of a slab evenly filled 3/4. Two surfaces are seen if they are at least 1.5 and at most 5 cm apart,
/// some 3.5 times their own noise, and each covers the voxel. The result does not depend on the order of points.
DoubleSurfaces find_double_surfaces(std::span<const Eigen::Vector3f> points, double voxel_m);

}  // namespace lodestone

#pragma once

#include <functional>

#include "core/lidar/voxel_planes.h"

namespace lodestone {

/// Thickness of the planes of a whole map (rms distance of their points, m). Sensors, surfaces and range make some maps
/// uneven. The lower half shows this spread, because voxels at edges are thick for another reason (docs/design/039).
struct PlaneThickness {
  double median_m = 0.0;
  double low_m = 0.0;          ///< one standard deviation below the median: the value of rank 15.9 %
  double noise_limit_m = 0.0;  ///< the map's own noise makes planes up to this thick

  /// One standard deviation of the logarithm.
  double log_spread() const;
};

/// Which planes count. Two limits are fixed: `fit.max_thickness_m` and `fit.max_thickness_ratio`. A plane that exceeds
/// one of them counts if the map's noise explains it. A third limit is relative to the map: where floor meets wall, a
/// voxel may contain a strip of the other surface that is too thin to be rejected by itself. Such a plane is three
/// standard deviations thicker than the map's planes.
class PlaneLimits {
 public:
  PlaneLimits(const PlaneThickness& thickness, const PlaneMapOptions& options);

  bool allow(const VoxelPlane& voxel) const;

 private:
  PlaneFitOptions fit_;
  double noise_limit_m_;
  double relative_limit_m_;
};

using VoxelPlaneVisitor = std::function<void(const VoxelPlane&)>;

/// Of a whole map. `for_each` calls its argument for each voxel, in any order; it is called twice.
PlaneThickness thickness_of(const std::function<void(const VoxelPlaneVisitor&)>& for_each,
                            const PlaneMapOptions& options);

/// `plane` with its variances inferred from the thickness of the map's planes and its own points together: the
/// posterior mean under the conjugate prior of at most 30 degrees of freedom, fewer if the map's planes differ by more
/// than chance (Smyth, Statistical Applications in Genetics and Molecular Biology 2004; docs/design/001). From eight
/// points alone, one variance in three is too small by a third. The prior is corrected for the three fitted parameters
/// as if it came from as many points as the plane has, so planes with few points, at the edge of the survey, get less
/// weight. A thickness of exactly zero is unchanged.
Plane with_shared_thickness(Plane plane, const PlaneThickness& thickness);

}  // namespace lodestone

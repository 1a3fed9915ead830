#pragma once

#include <cstdint>
#include <span>

#include "core/lidar/voxel_planes.h"

namespace lodestone {

/// What a cloud map is good for, by the voxels and planes of a run. Shares are 0 to 1.
struct CloudQuality {
  std::int64_t points = 0;
  Eigen::Vector3f low_m = Eigen::Vector3f::Zero();   ///< least x, y, z, map
  Eigen::Vector3f high_m = Eigen::Vector3f::Zero();  ///< largest x, y, z, map
  std::int64_t voxels = 0;                           ///< that contain points
  std::int64_t planes = 0;                           ///< of these, whose points make one plane
  double median_thickness_m = 0.0;     ///< standard deviation of a plane's points across it: median of the planes
  double ninetieth_thickness_m = 0.0;  ///< the same: 90th percentile
  double on_planes_share = 0.0;        ///< of the points: the run finds a plane in their voxel
  double doubled_share = 0.0;          ///< of the surface: two parallel surfaces, see measure_cloud
  double doubled_distance_m = 0.0;     ///< median distance of the two; 0 where nothing is doubled
  Eigen::Vector3f doubled_place_m = Eigen::Vector3f::Zero();  ///< centre of the doubled surface in the cube of
                                                              ///< kMapErrorCube_m that contains most of it, map
  double median_points_per_voxel = 0.0;
  double median_points_per_m2 = 0.0;  ///< of plane surface
};

/// Measures `points` (map frame, metres; finite). The surface is cut into voxels with their margin, as by PlaneMap.
///
/// A voxel is doubled if its points form two layers across their thinnest direction. The layers are found by Otsu's
/// threshold (IEEE Trans. SMC 9, 1979). Both must be planes by options.fit, parallel, above each other, and at most the
/// margin apart: the voxels on both sides of a face then contain both. They must be separate by Ashman's D = distance /
/// root mean square of both thicknesses (Ashman, Bird and Zepf, AJ 108, 1994) above 4.5. The halves of a Gaussian have
/// D = 2.65, those of a uniform layer 3.46. Layers that are closer count as one thick surface. Both sides of a thin
/// board or door count as doubled.
///
/// The thickness has the n − 3 degrees of freedom of a fitted plane, and leaves doubled voxels out. Thickness above
/// options.fit.max_thickness_m is not measured: such points are on no plane. Results do not depend on threads.
CloudQuality measure_cloud(std::span<const Eigen::Vector3f> points, const PlaneMapOptions& options);

}  // namespace lodestone

#pragma once

#include <span>
#include <vector>

#include "core/measurements.h"
#include "core/option_checks.h"
#include "core/sensor_suite.h"

namespace lodestone {

struct ScanSamplingOptions {
  double voxel_m = 0.3;
  int max_points = 20000;

  template <class Visitor>
  void visit(Visitor& visitor) {
    visitor.field("voxel_m", voxel_m,
                  "surfaces keep about one point of a scan in each square of this edge; 0 keeps all");
    visitor.field("max_points", max_points, "at most this many points of a scan, spread evenly over it");
  }

  void check() const {
    option_checks::not_negative("voxel_m", voxel_m);
    option_checks::within("max_points", max_points, 0, 10000000);
  }
};

/// The points of a scan worth registering: within the range limits of the LiDAR that measured them, thinned by how
/// densely their surroundings are hit, in the order of time. Positions stay in the lidar frame at each point's own
/// time. Deterministic.
///
/// Whether a point is kept must not depend on its own noise. One point a voxel does: a wall in a voxel's face puts the
/// far tail of its noise into voxels of their own, each of which would keep one, and the wall would seem to stand where
/// the tail is (docs/design/architecture.md has figures). So a point is kept with probability 9 / (points in the 3 × 3
/// × 3 voxels round its own), which is about 1 / (points a voxel) on a surface, by stratified drawing along each ring.
/// `lidars`: by LidarPoint::lidar.
std::vector<LidarPoint> sample_scan(const LidarScan& scan, std::span<const LidarModel> lidars,
                                    const ScanSamplingOptions& options);

/// Of a scan by one LiDAR.
inline std::vector<LidarPoint> sample_scan(const LidarScan& scan, const LidarModel& lidar,
                                           const ScanSamplingOptions& options) {
  return sample_scan(scan, std::span(&lidar, 1), options);
}

}  // namespace lodestone

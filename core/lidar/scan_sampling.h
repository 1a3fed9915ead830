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
    if (voxel_m > 0.0) option_checks::within("voxel_m", voxel_m, 0.01, 100.0);
    option_checks::within("max_points", max_points, 0, 10000000);
  }
};

/// The points of a scan for registration: within the range limits of the LiDAR that measured them, thinned by the
/// density of their surroundings, in order of time. Positions stay in the lidar frame at each point's own time.
/// Deterministic.
///
/// A point is kept with probability 9 / (points in the 3 × 3 × 3 voxels around its own), about 1 / (points a voxel) on
/// a surface, by stratified drawing along each ring. With one point a voxel instead, the choice would depend on the
/// point's own noise, which displaces walls (docs/design/003). `lidars`: by LidarPoint::lidar.
std::vector<LidarPoint> sample_scan(const LidarScan& scan, std::span<const LidarModel> lidars,
                                    const ScanSamplingOptions& options);

/// The bundle's sampled points, or if there are none, those that `sample_scan` chooses now: the same.
inline std::vector<LidarPoint> registration_points(const ScanBundle& bundle, std::span<const LidarModel> lidars,
                                                   const ScanSamplingOptions& options) {
  return bundle.sampled ? *bundle.sampled : sample_scan(bundle.scan, lidars, options);
}

/// Samples a scan of one LiDAR.
inline std::vector<LidarPoint> sample_scan(const LidarScan& scan, const LidarModel& lidar,
                                           const ScanSamplingOptions& options) {
  return sample_scan(scan, std::span(&lidar, 1), options);
}

}  // namespace lodestone

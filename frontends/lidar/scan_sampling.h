#pragma once

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
    visitor.field("voxel_m", voxel_m, "one point of a scan is kept in each voxel of this edge; 0 keeps all");
    visitor.field("max_points", max_points, "at most this many points of a scan, spread evenly over it");
  }

  void check() const {
    option_checks::not_negative("voxel_m", voxel_m);
    option_checks::within("max_points", max_points, 0, 10000000);
  }
};

/// The points of a scan worth registering: within the sensor's range limits, one for each voxel (the first in the
/// order of time), in that order. Positions stay in the lidar frame at each point's own time.
std::vector<LidarPoint> sample_scan(const LidarScan& scan, const LidarModel& lidar, const ScanSamplingOptions& options);

}  // namespace lodestone

#pragma once

#include <cstdint>
#include <vector>

#include "core/measurements.h"
#include "frontends/simulation/motion.h"
#include "frontends/simulation/ray_caster.h"

namespace lodestone::simulation {

/// A spinning LiDAR: rows evenly spread over the vertical field of view (ring 0 is the uppermost), columns in time as
/// the head turns clockwise from behind, every column cast from where the LiDAR is at that moment. Thread-safe.
class LidarSimulator {
 public:
  /// `caster` and `motion` must outlive this. `start_time` is the stamp of the motion's second 0.
  LidarSimulator(const RayCaster& caster, const Motion& motion, const LidarOptions& options, Time start_time,
                 std::uint64_t seed);

  /// Scans that fit wholly into the motion.
  int scan_count() const { return scan_count_; }
  Time scan_end(int index) const;

  /// Points in order of time, then ring. Depends on (seed, index) alone.
  LidarScan scan(int index) const;

 private:
  double column_seconds(int index, int column) const;

  const RayCaster& caster_;
  const Motion& motion_;
  LidarOptions options_;
  Pose T_imu_lidar_;
  Time start_time_;
  std::uint64_t seed_;
  int scan_count_ = 0;
  std::vector<Vector3> row_directions_;  ///< in the vertical plane x, z of the turning head
};

}  // namespace lodestone::simulation

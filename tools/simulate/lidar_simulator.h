#pragma once

#include <cstdint>

#include "core/measurements.h"
#include "tools/simulate/beam_pattern.h"
#include "tools/simulate/motion.h"
#include "tools/simulate/ray_caster.h"

namespace lodestone::simulation {

/// A LiDAR on a moving robot: every firing of its pattern cast from where the LiDAR is at that moment. Thread-safe.
class LidarSimulator {
 public:
  /// `caster` and `motion` must outlive this. `start_time` is the stamp of the motion's second 0.
  LidarSimulator(const RayCaster& caster, const Motion& motion, const LidarOptions& options, Time start_time,
                 std::uint64_t seed);

  /// Scans that fit wholly into the motion.
  int scan_count() const { return scan_count_; }
  Time scan_end(int index) const;

  /// Points in order of time, then ring (the line of the firing). Depends on (seed, index) alone.
  LidarScan scan(int index) const;

 private:
  const RayCaster& caster_;
  const Motion& motion_;
  LidarOptions options_;
  BeamPattern pattern_;
  Pose T_imu_lidar_;
  Time start_time_;
  std::uint64_t seed_;
  int scan_count_ = 0;
};

}  // namespace lodestone::simulation

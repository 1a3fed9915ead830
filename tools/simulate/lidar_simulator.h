#pragma once

#include <cstdint>

#include "core/measurements.h"
#include "core/random_stream.h"
#include "tools/simulate/beam_pattern.h"
#include "tools/simulate/motion.h"
#include "tools/simulate/movers.h"
#include "tools/simulate/ray_caster.h"
#include "tools/simulate/reality.h"

namespace lodestone::simulation {

/// A LiDAR on a moving robot: every firing is cast from the LiDAR's pose at the firing's time. Thread-safe.
class LidarSimulator {
 public:
  /// `caster`, `motion` and `movers` must outlive this object. `start_time` is the stamp of the motion's second 0.
  /// `errors`: the true errors against platform.yaml. `movers`: people and vehicles nearby (null: none).
  LidarSimulator(const RayCaster& caster, const Motion& motion, const LidarOptions& options, Time start_time,
                 std::uint64_t seed, LidarErrors errors = {}, const Movers* movers = nullptr);

  /// Number of scans that fit entirely into the motion.
  int scan_count() const { return scan_count_; }

  /// Stamp: the true time plus stamp_error_s().
  Time scan_end(int index) const;

  /// Stamp of a scan minus its true time: the clock offset plus this scan's jitter (limited to 3 sigma, and to less
  /// than would change the order of scans).
  double stamp_error_s(int index) const;

  /// Points ordered by time, then ring (the line of the firing). Depends on (seed, index) alone.
  LidarScan scan(int index) const;

 private:
  /// All beams of one firing, against the world and the movers.
  struct Firing;
  void cast(const Firing& firing, RandomStream& glass, std::span<RayHit> hits) const;
  void mix(const Firing& firing, RandomStream& random, RandomStream& glass, std::span<RayHit> hits) const;
  double range_bias(int line, const RayHit& hit) const;

  const RayCaster& caster_;
  const Motion& motion_;
  LidarErrors errors_;
  const Movers* movers_;
  LidarOptions options_;
  BeamPattern pattern_;
  Pose T_imu_lidar_;
  Time start_time_;
  std::uint64_t seed_;
  int scan_count_ = 0;
};

}  // namespace lodestone::simulation

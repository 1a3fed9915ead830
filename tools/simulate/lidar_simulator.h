#pragma once

#include <cstdint>

#include "core/measurements.h"
#include "tools/simulate/beam_pattern.h"
#include "tools/simulate/motion.h"
#include "tools/simulate/movers.h"
#include "tools/simulate/random.h"
#include "tools/simulate/ray_caster.h"
#include "tools/simulate/reality.h"

namespace lodestone::simulation {

/// A LiDAR on a moving robot: every firing of its pattern cast from where the LiDAR is at that moment. Thread-safe.
class LidarSimulator {
 public:
  /// `caster`, `motion` and `movers` must outlive this. `start_time` is the stamp of the motion's second 0. `errors` is
  /// what platform.yaml does not know; `movers` are who walks by (null: nobody).
  LidarSimulator(const RayCaster& caster, const Motion& motion, const LidarOptions& options, Time start_time,
                 std::uint64_t seed, LidarErrors errors = {}, const Movers* movers = nullptr);

  /// Scans that fit wholly into the motion.
  int scan_count() const { return scan_count_; }

  /// As stamped: the true time, plus what stamp_error_s says.
  Time scan_end(int index) const;

  /// Stamp of a scan minus its true time: the clock's offset and this scan's jitter (at most 3 sigma, and never so much
  /// that scans change their order).
  double stamp_error_s(int index) const;

  /// Points in order of time, then ring (the line of the firing). Depends on (seed, index) alone.
  LidarScan scan(int index) const;

 private:
  /// All beams of one firing, against the world and whoever moves in it.
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

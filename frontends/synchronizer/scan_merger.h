#pragma once

#include <cstdint>
#include <deque>
#include <vector>

#include "core/geometry/pose.h"
#include "core/measurements.h"
#include "core/sensor_suite.h"
#include "core/warnings.h"

namespace lodestone {

/// Merges the scans of several LiDARs. The scans of the first LiDAR set the period; every point of the others joins the
/// scan in whose interval (end of the previous scan, end] it lies. Points are transformed to the first LiDAR's frame by
/// the extrinsics. This is exact, because each point keeps its own time and deskewing moves it with the body. Each
/// point has the index of its LiDAR, whose limits of range, incidence and noise apply.
///
/// A scan is complete when all others have reached its end, or, if one is silent, after two more scans of the first.
/// Counted in `warnings`: lidar.unmerged_points (discarded: too late, or without a scan of the first LiDAR at their
/// time).
class ScanMerger {
 public:
  /// `first`: the LiDAR that defines the frame of the result; `others`: further LiDARs. `warnings` must outlive this.
  ScanMerger(const LidarModel& first, const std::vector<LidarModel>& others, WarningLog& warnings);

  /// Adds a scan of LiDAR `lidar` (0: the first). Scans of one LiDAR must be in order of time.
  void add(std::size_t lidar, LidarScan&& scan);

  /// Signals the end of the log: queued scans are returned as they are.
  void finish() { ended_ = true; }

  /// The next complete scan: the first LiDAR's points in their order, then those of the others. Returns false if more
  /// scans are required.
  bool take(LidarScan& merged);

 private:
  struct Other {
    Pose T_first_other;
    std::deque<LidarScan> scans;  ///< positions in the first LiDAR's frame
    Time reached = 0;             ///< end of the last scan
    bool any = false;
  };
  void join(Other& other, Time after, LidarScan& merged, std::vector<Time>& times);

  WarningLog& warnings_;
  Time period_;  ///< of the first LiDAR
  std::deque<LidarScan> first_;
  std::vector<Other> others_;
  Time previous_end_ = 0;
  bool started_ = false, ended_ = false;
};

}  // namespace lodestone

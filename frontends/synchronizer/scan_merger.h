#pragma once

#include <cstdint>
#include <deque>
#include <vector>

#include "core/geometry/pose.h"
#include "core/measurements.h"
#include "core/sensor_suite.h"
#include "core/warnings.h"

namespace lodestone {

/// Makes one scan of what several LiDARs saw: the scans of the first set the pace, and every point of the others joins
/// the one within whose time it lies, (end of the scan before, end]. Points are brought to the first LiDAR's frame by
/// the extrinsics, which is exact, for each keeps its own time: deskewing moves it with the body. Each names the LiDAR
/// that measured it: limits of range, incidence and noise are those of its own.
///
/// A scan is held until the others have come to its end; where one stays silent, until two more of the first are there.
/// Counted in `warnings`: lidar.unmerged_points (came too late, or with no scan of the first around them; dropped).
class ScanMerger {
 public:
  /// `first`: of whose frame the result is; `others`: further LiDARs. `warnings` must outlive this.
  ScanMerger(const LidarModel& first, const std::vector<LidarModel>& others, WarningLog& warnings);

  /// A scan of LiDAR `lidar` (0: the first); scans of one LiDAR come in order.
  void add(std::size_t lidar, LidarScan&& scan);

  /// No scan will come any more: what is held is given as it is.
  void finish() { ended_ = true; }

  /// The next scan that is complete: the first LiDAR's points in their order, then those of the others. False where
  /// more must be added before.
  bool take(LidarScan& merged);

 private:
  struct Other {
    Pose T_first_other;
    std::deque<LidarScan> scans;  ///< positions in the first LiDAR's frame
    Time reached = 0;             ///< end of the last
    bool any = false;
  };
  void join(Other& other, Time after, LidarScan& merged, std::vector<Time>& times);

  WarningLog& warnings_;
  Time period_;  ///< of the first
  std::deque<LidarScan> first_;
  std::vector<Other> others_;
  Time previous_end_ = 0;
  bool started_ = false, ended_ = false;
};

}  // namespace lodestone

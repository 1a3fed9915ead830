#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "core/geometry/trajectory.h"
#include "core/mapping/free_space.h"
#include "core/measurement_source.h"
#include "core/sensor_suite.h"

namespace lodestone {

/// A time in which scans have points without a pose.
struct ScanGap {
  Time begin = 0;  ///< start of the first such scan
  Time end = 0;    ///< end of the last one
};

/// Counts of a survey's scans.
struct ScanSurvey {
  std::int64_t scans = 0;
  std::int64_t points = 0;        ///< with a pose and within the range limits
  std::int64_t out_of_range = 0;  ///< nearer or farther than the limits of their LiDAR
  std::int64_t without_pose = 0;  ///< discarded points outside the trajectory or in one of its gaps
  std::vector<ScanGap> gaps;      ///< in order of time
};

/// Calls `use` with the rays of each scan of `source` in the map frame. Every point is transformed with the pose
/// (T_map_imu) at its own time, interpolated on the trajectory. Points whose neighbouring poses are more than `max_gap`
/// (ns) apart are discarded and counted. A ray begins at the LiDAR that measured the point. `progress` is called with
/// each measurement's time.
ScanSurvey read_scans(MeasurementSource& source, const Trajectory& trajectory, const SensorSuite& suite, Time max_gap,
                      const std::function<void(std::span<const LidarRay>)>& use,
                      const std::function<void(Time)>& progress = {});

}  // namespace lodestone

#include "frontends/synchronizer/scan_survey.h"

#include "core/lidar/lidar_poses.h"
#include "core/lidar/range_limits.h"

namespace lodestone {

ScanSurvey read_scans(MeasurementSource& source, const Trajectory& trajectory, const SensorSuite& suite, Time max_gap,
                      const std::function<void(std::span<const LidarRay>)>& use,
                      const std::function<void(Time)>& progress) {
  const std::vector<RangeLimits> limits = range_limits_of(suite.lidars());
  LidarPoses poses(trajectory, suite.lidar.T_imu_lidar, max_gap);
  ScanSurvey survey;
  std::vector<LidarRay> rays;
  bool in_gap = false;
  for (Measurement measurement; source.next(measurement);) {
    if (progress) progress(completion_time(measurement));
    const auto* scan = std::get_if<LidarScan>(&measurement);
    if (scan == nullptr) continue;
    ++survey.scans;
    rays.clear();
    std::int64_t without_pose = 0;
    for (const LidarPoint& point : scan->points) {
      const RangeLimits& lidar = limits.at(point.lidar);
      if (!lidar.hold(point)) {
        ++survey.out_of_range;
        continue;
      }
      const std::optional<Pose>& T_map_lidar = poses.at(scan->start + point.offset_ns);
      if (!T_map_lidar) {
        ++without_pose;
        continue;
      }
      rays.push_back({(*T_map_lidar * lidar.origin.cast<double>()).cast<float>(),
                      (*T_map_lidar * point.position.cast<double>()).cast<float>()});
    }
    survey.points += static_cast<std::int64_t>(rays.size());
    survey.without_pose += without_pose;
    if (without_pose > 0) {
      if (!in_gap) survey.gaps.push_back({scan->start, scan->end});
      survey.gaps.back().end = scan->end;
    }
    in_gap = without_pose > 0;
    if (!rays.empty()) use(rays);
  }
  return survey;
}

}  // namespace lodestone

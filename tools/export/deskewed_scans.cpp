#include "tools/export/deskewed_scans.h"

#include "core/lidar/lidar_poses.h"
#include "frontends/synchronizer/bag_source.h"

namespace lodestone {

namespace {

/// Between neighbouring poses. Larger gaps are losses of the track; the slowest LiDARs scan once a second.
constexpr Time kLargestGap = 2'000'000'000;

}  // namespace

struct DeskewedScans::Implementation {
  Implementation(const std::string& log, const Platform& platform, const Trajectory& trajectory)
      : source(log, platform, warnings, {.lidar = true, .imu = false, .magnetometers = false, .wheels = false}),
        poses(trajectory, platform.suite.lidar.T_imu_lidar, kLargestGap) {}

  WarningLog warnings;
  BagSource source;
  LidarPoses poses;
};

DeskewedScans::DeskewedScans(const std::string& log, const Platform& platform, const Trajectory& trajectory)
    : implementation_(std::make_unique<Implementation>(log, platform, trajectory)) {}

DeskewedScans::~DeskewedScans() = default;

std::optional<DeskewedScan> DeskewedScans::next() {
  Implementation& self = *implementation_;
  for (Measurement measurement; self.source.next(measurement);) {
    const auto* scan = std::get_if<LidarScan>(&measurement);
    if (scan == nullptr) continue;
    DeskewedScan result;
    result.end = scan->end;
    for (const LidarPoint& point : scan->points) {
      const std::optional<Pose>& T_map_lidar = self.poses.at(scan->start + point.offset_ns);
      if (!T_map_lidar) continue;
      const Eigen::Vector3f in_map = (*T_map_lidar * point.position.cast<double>()).cast<float>();
      result.cloud.add({in_map.x(), in_map.y(), in_map.z(), point.intensity});
    }
    if (!result.cloud.empty()) return result;
  }
  return std::nullopt;
}

const WarningLog& DeskewedScans::warnings() const {
  return implementation_->warnings;
}

}  // namespace lodestone

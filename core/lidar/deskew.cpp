#include "core/lidar/deskew.h"

namespace lodestone {

std::vector<Eigen::Vector3f> deskew(std::span<const LidarPoint> points, Time scan_start, const ScanMotion& motion,
                                    const Pose& T_imu_lidar) {
  std::vector<Eigen::Vector3f> result(points.size());
  // All points of one firing share their time and so their transform.
  std::int32_t offset_ns = 0;
  bool first = true;
  Eigen::Matrix3f rotation;
  Eigen::Vector3f position;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (first || points[i].offset_ns != offset_ns) {
      offset_ns = points[i].offset_ns;
      first = false;
      const Pose T_end_lidar = motion.relative_pose(scan_start + offset_ns) * T_imu_lidar;
      rotation = T_end_lidar.rotation.toRotationMatrix().cast<float>();
      position = T_end_lidar.position.cast<float>();
    }
    result[i] = rotation * points[i].position + position;
  }
  return result;
}

std::vector<float> ages_at(Time end, std::span<const LidarPoint> points, Time scan_start) {
  std::vector<float> result;
  result.reserve(points.size());
  for (const LidarPoint& point : points) {
    result.push_back(static_cast<float>(to_seconds(end - scan_start - point.offset_ns)));
  }
  return result;
}

}  // namespace lodestone

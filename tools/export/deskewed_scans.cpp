#include "tools/export/deskewed_scans.h"

#include <fmt/format.h>

#include <limits>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/lidar/lidar_poses.h"
#include "core/lidar/plane_map.h"
#include "frontends/configuration/trajectory_file.h"
#include "frontends/synchronizer/bag_source.h"

namespace lodestone {

namespace {

/// Between neighbouring poses. Larger gaps are losses of the track; the slowest LiDARs scan once a second.
constexpr Time kLargestGap = 2'000'000'000;

constexpr float kFarthestPlane_m = 0.5F;  // beyond, a point belongs to something else

}  // namespace

struct DeskewedScans::Implementation {
  Implementation(const std::string& log, const Platform& platform, const Trajectory& trajectory,
                 std::shared_ptr<const PlaneMapSource> map)
      : source(log, platform, warnings, {.lidar = true, .imu = false, .magnetometers = false, .wheels = false}),
        poses(trajectory, platform.suite.lidar.T_imu_lidar, kLargestGap),
        planes(std::move(map)) {
    if (trajectory.empty()) return;
    const Time from = trajectory.front().time, to = trajectory.back().time;
    if (to >= source.begin_time() && from <= source.end_time()) return;
    throw InputError(fmt::format("{}: no scan has a pose: the log spans {}, and the run {}; use the log of this run",
                                 log, span_text(source.begin_time(), source.end_time()), span_text(from, to)));
  }

  /// Distance from the plane, positive on the side of the LiDAR.
  static float residual_m(const Plane* plane, const Eigen::Vector3f& point, const Eigen::Vector3f& lidar) {
    if (plane == nullptr) return std::numeric_limits<float>::quiet_NaN();
    return plane->distance(lidar) < 0.0F ? -plane->distance(point) : plane->distance(point);
  }

  /// The points in the map frame; `lidar_m`: where the LiDAR was.
  PackedCloud packed(const std::vector<Eigen::Vector3f>& points, const std::vector<float>& intensities,
                     const Vector3& lidar_m) const {
    const std::shared_ptr<const PlaneMap> map = planes == nullptr ? nullptr : planes->around(lidar_m);
    std::vector<std::string> fields{"x", "y", "z", "intensity"};
    if (map != nullptr) fields.emplace_back("residual_m");
    PackedCloud cloud(std::move(fields));
    std::vector<const Plane*> found(points.size());
    if (map != nullptr) map->match(points, kFarthestPlane_m, found);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Eigen::Vector3f& point = points[i];
      cloud.add({point.x(), point.y(), point.z(), intensities[i]});
      if (map != nullptr) cloud.add({residual_m(found[i], point, lidar_m.cast<float>())});
    }
    return cloud;
  }

  WarningLog warnings;
  BagSource source;
  LidarPoses poses;
  std::shared_ptr<const PlaneMapSource> planes;
};

DeskewedScans::DeskewedScans(const std::string& log, const Platform& platform, const Trajectory& trajectory,
                             std::shared_ptr<const PlaneMapSource> planes)
    : implementation_(std::make_unique<Implementation>(log, platform, trajectory, std::move(planes))) {}

DeskewedScans::~DeskewedScans() = default;

std::optional<DeskewedScan> DeskewedScans::next() {
  Implementation& self = *implementation_;
  for (Measurement measurement; self.source.next(measurement);) {
    const auto* scan = std::get_if<LidarScan>(&measurement);
    if (scan == nullptr) continue;
    std::vector<Eigen::Vector3f> points;
    std::vector<float> intensities;
    Vector3 lidar_m = Vector3::Zero();
    for (const LidarPoint& point : scan->points) {
      const std::optional<Pose>& T_map_lidar = self.poses.at(scan->start + point.offset_ns);
      if (!T_map_lidar) continue;
      points.push_back((*T_map_lidar * point.position.cast<double>()).cast<float>());
      intensities.push_back(point.intensity);
      lidar_m = T_map_lidar->position;
    }
    if (!points.empty()) return DeskewedScan{scan->end, self.packed(points, intensities, lidar_m)};
  }
  return std::nullopt;
}

const WarningLog& DeskewedScans::warnings() const {
  return implementation_->warnings;
}

}  // namespace lodestone

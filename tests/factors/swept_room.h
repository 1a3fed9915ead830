#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

#include "core/imu/scan_motion.h"
#include "core/lidar/correspondence.h"
#include "core/lidar/lidar_correction.h"
#include "tests/factors/window_scene.h"

namespace lodestone {

inline constexpr double kPointNoiseM = 0.01;
inline constexpr double kRangeM = 10.0;

/// Points of a room measured by a LiDAR with one turn per step: points in axes of the LiDAR at their own times, which
/// are the body's axes for the platform file's mounting.
struct Sweep {
  std::vector<Plane> planes;
  std::vector<Vector3> points;
  std::vector<std::size_t> interval;  // IMU interval at whose end each point was measured
};

inline Sweep sweep_of(const std::vector<Pose>& between, const std::vector<Vector3>& normals, int points_an_interval,
                      Random& random) {
  Sweep result;
  for (std::size_t i = 0; i < between.size(); ++i) {
    const double angle = 2.0 * M_PI * static_cast<double>(i) / static_cast<double>(between.size());
    for (int j = 0; j < points_an_interval; ++j) {
      const Vector3 ahead(std::cos(angle), std::sin(angle), 0.0);
      const Vector3 point = kRangeM * ahead + random.vector(0.2 * kRangeM);
      const Vector3& normal =
          normals[(i * static_cast<std::size_t>(points_an_interval) + static_cast<std::size_t>(j)) % normals.size()];
      Plane plane;
      plane.normal = normal.cast<float>();
      plane.major = Eigen::Vector3f(plane.normal.unitOrthogonal());
      plane.center = (between[i] * point + kPointNoiseM * random.normal() * normal).cast<float>();
      result.planes.push_back(plane);
      result.points.push_back(point);
      result.interval.push_back(i);
    }
  }
  return result;
}

inline std::vector<Correspondence> deskewed(const Sweep& sweep, const ScanMotion& motion, double step_s,
                                            std::size_t intervals, const LidarCorrection& correction = {}) {
  const Pose T_imu_lidar = correction.corrected(Pose{});
  std::vector<Correspondence> result;
  for (std::size_t i = 0; i < sweep.points.size(); ++i) {
    const double age_s =
        step_s * static_cast<double>(intervals - 1 - sweep.interval[i]) / static_cast<double>(intervals) +
        correction.clock_s;
    const Pose T_end_t = motion.relative_pose(motion.end_time() - from_seconds(age_s));
    Correspondence match{(T_end_t * (T_imu_lidar * sweep.points[i])).cast<float>(), &sweep.planes[i],
                         static_cast<float>(kPointNoiseM * kPointNoiseM)};
    match.age_s = static_cast<float>(age_s);
    result.push_back(match);
  }
  return result;
}

}  // namespace lodestone

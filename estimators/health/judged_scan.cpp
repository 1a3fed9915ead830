#include "estimators/health/judged_scan.h"

#include <algorithm>
#include <cstdint>
#include <unordered_set>

#include "core/imu/scan_motion.h"
#include "core/lidar/deskew.h"
#include "core/lidar/places_in_map.h"
#include "core/lidar/range_limits.h"
#include "core/lidar/voxel_planes.h"

namespace lodestone {

namespace {

constexpr std::size_t kSampledPoints = 4000;  // of a scan
constexpr double kEven_m = 1.0;               // one point in each cube of this edge: neighbours say the same
constexpr std::size_t kJudgedPoints = 400;    // of these
constexpr std::size_t kFewest = 20;           // points above the floor
constexpr double kAboveFloor_m = 0.3;         // all floors look alike
constexpr double kFloorRange_m = 20.0;        // where the floor is looked for
constexpr double kLowestShare = 0.02;         // of the points: the floor
constexpr float kOnPlane_m = 0.15F;           // of a point that agrees with a plane

/// The first point in each cube, at most kJudgedPoints, spread evenly over the scan. Without this, a pallet beside the
/// robot counts more than the hall.
std::vector<Eigen::Vector3f> spread_evenly(const std::vector<Eigen::Vector3f>& points) {
  std::unordered_set<std::uint64_t> taken;
  std::vector<Eigen::Vector3f> firsts;
  for (const Eigen::Vector3f& point : points) {
    if (taken.insert(voxel_key(voxel_of(point, static_cast<float>(1.0 / kEven_m)))).second) firsts.push_back(point);
  }
  const std::size_t every = firsts.size() / kJudgedPoints + 1;
  std::vector<Eigen::Vector3f> judged;
  for (std::size_t i = 0; i < firsts.size(); i += every) judged.push_back(firsts[i]);
  return judged;
}

}  // namespace

JudgedScan judged_scan(const ScanBundle& bundle, const Estimate& estimate, const SensorSuite& suite) {
  JudgedScan result;
  NavState state = estimate.state;
  if (estimate.scan_pose) state.T_map_imu = *estimate.scan_pose;
  result.T_map_imu = state.T_map_imu;
  const std::vector<LidarModel> lidars = suite.lidars();
  const std::vector<RangeLimits> limits = range_limits_of(lidars);
  const auto is_within = [&](const LidarPoint& point) { return limits[point.lidar].hold(point); };
  const auto within = static_cast<std::size_t>(std::ranges::count_if(bundle.scan.points, is_within));
  const std::size_t every = std::max<std::size_t>(1, within / kSampledPoints);
  std::size_t i = 0;
  for (const LidarPoint& point : bundle.scan.points) {
    if (is_within(point) && i++ % every == 0) result.measured.push_back(point);
  }
  result.all = deskew(result.measured, bundle.scan.start, ScanMotion(state, bundle.imu), suite.lidar.T_imu_lidar);
  const Eigen::Vector3f up = (state.T_map_imu.rotation.conjugate() * Vector3::UnitZ()).cast<float>();
  std::vector<float> heights_m;
  for (const Eigen::Vector3f& point : result.all) {
    if (point.norm() < kFloorRange_m) heights_m.push_back(up.dot(point));
  }
  if (heights_m.size() < kFewest) return result;
  const auto lowest = heights_m.begin() + static_cast<std::ptrdiff_t>(kLowestShare * heights_m.size());
  std::nth_element(heights_m.begin(), lowest, heights_m.end());
  const float floor_m = *lowest + static_cast<float>(kAboveFloor_m);
  std::vector<Eigen::Vector3f> above;
  for (const Eigen::Vector3f& point : result.all) {
    if (!(up.dot(point) < floor_m)) above.push_back(point);
  }
  result.even = spread_evenly(above);
  if (result.even.size() < kFewest) result.even.clear();
  return result;
}

double share_on_map(std::span<const Eigen::Vector3f> points, const Pose& T_map_imu, const PlaneMap& map) {
  int hits = 0;
  for (const Eigen::Vector3f& place : places_in_map(points, T_map_imu)) hits += map.agrees(place, kOnPlane_m) ? 1 : 0;
  return static_cast<double>(hits) / static_cast<double>(points.size());
}

}  // namespace lodestone

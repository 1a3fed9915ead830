#include "tools/check/scan_odometry.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <limits>
#include <memory>
#include <numeric>

#include "core/angles.h"
#include "core/lidar/plane_map.h"
#include "estimators/initialization/scan_registration.h"
#include "tools/check/scan_tracking.h"

namespace lodestone {
namespace {

constexpr std::size_t kept_keyframes = 12;
constexpr double keyframe_m = 0.25;
constexpr double keyframe_rad = 0.12;
constexpr double longest_step_s = 1.0;  // no prediction across longer outages
constexpr int rounds = 2;               // rounds of deskewing and registration
// No robot moves so fast between two scans. From there on, odometry is lost.
constexpr double largest_turn_step_rad_s = 2.0;
constexpr double largest_velocity_step_m_s = 3.0;
// A single sparse scan has few planes: voxels far away contain at most one row of points.
constexpr double least_share = 0.03;
constexpr double fewest_on_planes = 60.0;
constexpr double enough_of_few = 0.4;  // share for scans with hardly more points than that
// Share of points on planes relative to the predicted pose, and relative to the last scan. Above 0.85 on all shipped
// worlds.
constexpr double least_of_before = 0.6;
// Uncertainty of the initial motion, and the usual change of motion from scan to scan.
constexpr PredictionSigmas initial_sigmas{4.0 * degree, 0.3};
constexpr double turn_change_sigma_rad_s2 = 5.0;
constexpr double velocity_change_sigma_m_s2 = 10.0;
constexpr std::size_t beginning = 3;

/// Candidate voxel sides: the rows of a scan must fall into one voxel. The finest side with enough points on planes is
/// used, otherwise the side with the most.
constexpr std::array<double, 3> voxel_edges_m{0.6, 1.2, 2.4};
constexpr double enough_on_planes = 0.05;

PlaneMapOptions local_planes(double voxel_m) {
  PlaneMapOptions options;
  options.voxel_m = voxel_m;
  options.margin_m = std::min(voxel_m / 6.0, 0.2);
  options.fit.min_points = 8;
  options.fit.max_thickness_m = 0.05;
  options.fit.min_spread_m = 0.1 * voxel_m;
  options.max_thickness_over_median = 0.0;
  return options;
}

/// A motion at constant velocity in the moving frame.
struct Twist {
  Vector3 turn_rad_s = Vector3::Zero();
  Vector3 velocity_m_s = Vector3::Zero();

  Pose over(double seconds) const { return {so3::exp(turn_rad_s * seconds), velocity_m_s * seconds}; }
};

Twist twist_between(const Pose& before, const Pose& after, double seconds) {
  const Pose step = before.inverse() * after;
  return {so3::log(step.rotation) / seconds, step.position / seconds};
}

PredictionSigmas sigmas_after(std::size_t scans, double step_s) {
  if (scans < beginning) return initial_sigmas;
  return {std::clamp(turn_change_sigma_rad_s2 * step_s * step_s, 1.0 * degree, initial_sigmas.sigma_rad),
          std::clamp(velocity_change_sigma_m_s2 * step_s * step_s, 0.02, initial_sigmas.sigma_m)};
}

/// The mean of the points' times. There, errors of the twist used for deskewing cancel; at the scan's end, they would
/// cause a delay of some 25 ms at 10 Hz. Points without times have the scan's stamp.
Time middle_of(const LidarScan& scan) {
  const auto add = [](double sum, const LidarPoint& point) { return sum + point.offset_ns; };
  const double mean_ns =
      std::accumulate(scan.points.begin(), scan.points.end(), 0.0, add) / static_cast<double>(scan.points.size());
  return scan.start + static_cast<Time>(std::llround(mean_ns));
}

std::vector<Eigen::Vector3f> deskew_to_middle(const LidarScan& scan, const Twist& twist) {
  std::vector<Eigen::Vector3f> points;
  points.reserve(scan.points.size());
  const Time middle = middle_of(scan);
  std::int32_t offset_ns = std::numeric_limits<std::int32_t>::min();
  Eigen::Matrix3f rotation = Eigen::Matrix3f::Identity();
  Eigen::Vector3f position = Eigen::Vector3f::Zero();
  for (const LidarPoint& point : scan.points) {
    if (point.offset_ns != offset_ns) {
      offset_ns = point.offset_ns;
      const Pose T_middle_then = twist.over(to_seconds(scan.start + offset_ns - middle));
      rotation = T_middle_then.rotation.toRotationMatrix().cast<float>();
      position = T_middle_then.position.cast<float>();
    }
    points.push_back(rotation * point.position + position);
  }
  return points;
}

/// Planes of the last keyframes.
class LocalMap {
 public:
  bool empty() const { return keyframes_.empty(); }
  const PlaneMap& planes() const { return *planes_; }

  void add(const Pose& pose, const std::vector<Eigen::Vector3f>& points) {
    if (!keyframes_.empty()) {
      const Pose step = keyframes_.back().pose.inverse() * pose;
      const bool moved = step.position.norm() > keyframe_m || so3::log(step.rotation).norm() > keyframe_rad;
      if (!moved && keyframes_.size() > 1) return;
    }
    Keyframe keyframe{pose, {}};
    const Eigen::Matrix3f rotation = pose.rotation.toRotationMatrix().cast<float>();
    const Eigen::Vector3f position = pose.position.cast<float>();
    for (const Eigen::Vector3f& point : points) keyframe.points.push_back(rotation * point + position);
    keyframes_.push_back(std::move(keyframe));
    if (keyframes_.size() > kept_keyframes) keyframes_.pop_front();
    std::vector<Eigen::Vector3f> all;
    for (const Keyframe& each : keyframes_) all.insert(all.end(), each.points.begin(), each.points.end());
    if (keyframes_.size() == 1) choose_voxel(all);
    planes_ = std::make_shared<const PlaneMap>(all, local_planes(voxel_m_));
  }

 private:
  struct Keyframe {
    Pose pose;
    std::vector<Eigen::Vector3f> points;  // start frame
  };

  void choose_voxel(const std::vector<Eigen::Vector3f>& points) {
    double largest = -1.0;
    for (const double edge_m : voxel_edges_m) {
      const double share = agreement(points, Pose{}, PlaneMap(points, local_planes(edge_m))).share;
      if (share <= largest) continue;
      largest = share;
      voxel_m_ = edge_m;
      if (share >= enough_on_planes) return;
    }
  }

  double voxel_m_ = voxel_edges_m.front();
  std::deque<Keyframe> keyframes_;
  std::shared_ptr<const PlaneMap> planes_;
};

}  // namespace

ScanOdometry follow_scans(std::span<const LidarScan> scans, const LidarModel& lidar) {
  LidarModel own = lidar;
  own.T_imu_lidar = Pose{};
  ScanOdometry result;
  LocalMap map;
  Twist twist;
  std::size_t followed = 0;  // since the last outage
  double share_of_last = 0.0;
  for (const LidarScan& scan : scans) {
    if (scan.points.empty()) continue;
    const Time time = middle_of(scan);
    const StampedPose before = result.poses.empty() ? StampedPose{time, Pose{}} : result.poses.back();
    const double step_s = to_seconds(time - before.time);
    if (!result.poses.empty() && !(step_s > 0.0)) continue;  // within the previous scan
    if (step_s > longest_step_s) {
      map = LocalMap{};
      twist = Twist{};
    }
    if (map.empty()) {
      const std::vector<Eigen::Vector3f> points = deskew_to_middle(scan, twist);
      result.poses.push_back({time, before.pose});
      if (result.first_scan.empty()) result.first_scan = points;
      map.add(before.pose, points);
      followed = 1;
      continue;
    }
    const Twist predicted = twist;
    const Pose predicted_pose = before.pose * twist.over(step_s);
    const PredictionSigmas sigmas = sigmas_after(followed, step_s);
    std::vector<Eigen::Vector3f> points = deskew_to_middle(scan, twist);
    double share_before = agreement(points, predicted_pose, map.planes()).share;
    if (followed > 1) share_before = std::max(share_before, share_of_last);
    TrackedScan tracked;
    for (int round = 0; round < rounds; ++round) {
      if (round > 0) points = deskew_to_middle(scan, twist);
      tracked = track_scan(points, predicted_pose, sigmas, map.planes(), own);
      twist = twist_between(before.pose, tracked.pose, step_s);
    }
    const Pose& pose = tracked.pose;
    const double share = agreement(points, pose, map.planes()).share;
    const bool leaps = (twist.turn_rad_s - predicted.turn_rad_s).norm() > largest_turn_step_rad_s ||
                       (twist.velocity_m_s - predicted.velocity_m_s).norm() > largest_velocity_step_m_s;
    const double fewest = std::min(enough_of_few, fewest_on_planes / static_cast<double>(points.size()));
    if (share < std::max(least_share, fewest) || share < least_of_before * share_before || leaps) {
      result.lost = true;
      break;
    }
    if (tracked.is_degenerate && !result.first_degenerate) result.first_degenerate = time;
    ++followed;
    share_of_last = share;
    result.poses.push_back({time, pose});
    map.add(pose, points);
  }
  return result;
}

}  // namespace lodestone

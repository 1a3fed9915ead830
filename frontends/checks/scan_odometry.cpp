#include "frontends/checks/scan_odometry.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <memory>

#include "core/maps/plane_map.h"
#include "frontends/localization/scan_registration.h"

namespace lodestone {
namespace {

constexpr std::size_t kept_keyframes = 12;
constexpr double keyframe_m = 0.25;
constexpr double keyframe_rad = 0.12;
constexpr double longest_step_s = 1.0;  // over longer outages nothing is predicted
constexpr int rounds = 2;               // of deskewing and registering
// What no robot does from one scan to the next: the way is lost from there on.
constexpr double largest_turn_step_rad_s = 2.0;
constexpr double largest_velocity_step_m_s = 3.0;
constexpr double least_share = 0.25;

PlaneMapOptions local_planes() {
  PlaneMapOptions options;
  options.voxel_m = 0.6;  // the rows of a scan must fall into one voxel
  options.margin_m = 0.1;
  options.fit.min_points = 8;
  options.fit.max_thickness_m = 0.05;
  options.fit.min_spread_m = 0.06;
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

std::vector<Eigen::Vector3f> deskew_at(const LidarScan& scan, const Twist& twist) {
  std::vector<Eigen::Vector3f> points;
  points.reserve(scan.points.size());
  std::int32_t offset_ns = std::numeric_limits<std::int32_t>::min();
  Eigen::Matrix3f rotation = Eigen::Matrix3f::Identity();
  Eigen::Vector3f position = Eigen::Vector3f::Zero();
  for (const LidarPoint& point : scan.points) {
    if (point.offset_ns != offset_ns) {
      offset_ns = point.offset_ns;
      const Pose T_end_then = twist.over(to_seconds(scan.start + offset_ns - scan.end));
      rotation = T_end_then.rotation.toRotationMatrix().cast<float>();
      position = T_end_then.position.cast<float>();
    }
    points.push_back(rotation * point.position + position);
  }
  return points;
}

/// The planes of the last scans that were taken at different places.
class LocalMap {
 public:
  bool empty() const { return keyframes_.empty(); }
  const PlaneMap& planes() const { return *planes_; }

  void add(const Pose& pose, const std::vector<Eigen::Vector3f>& points) {
    if (!keyframes_.empty()) {
      const Pose step = keyframes_.back().pose.inverse() * pose;
      const bool moved = step.position.norm() > keyframe_m || so3::log(step.rotation).norm() > keyframe_rad;
      if (!moved && (keyframes_.size() > 1 || ++standing_ > 3)) return;
    }
    Keyframe keyframe{pose, {}};
    const Eigen::Matrix3f rotation = pose.rotation.toRotationMatrix().cast<float>();
    const Eigen::Vector3f position = pose.position.cast<float>();
    for (const Eigen::Vector3f& point : points) keyframe.points.push_back(rotation * point + position);
    keyframes_.push_back(std::move(keyframe));
    if (keyframes_.size() > kept_keyframes) keyframes_.pop_front();
    std::vector<Eigen::Vector3f> all;
    for (const Keyframe& each : keyframes_) all.insert(all.end(), each.points.begin(), each.points.end());
    planes_ = std::make_shared<const PlaneMap>(all, local_planes());
  }

 private:
  struct Keyframe {
    Pose pose;
    std::vector<Eigen::Vector3f> points;  // start frame
  };
  std::deque<Keyframe> keyframes_;
  std::shared_ptr<const PlaneMap> planes_;
  int standing_ = 0;
};

}  // namespace

ScanOdometry follow_scans(std::span<const LidarScan> scans, const LidarModel& lidar) {
  LidarModel own = lidar;
  own.T_imu_lidar = Pose{};
  ScanOdometry result;
  LocalMap map;
  Twist twist;
  for (const LidarScan& scan : scans) {
    if (scan.points.empty()) continue;
    if (map.empty()) {
      result.poses.push_back({scan.end, Pose{}});
      result.share.push_back(1.0);
      result.points.push_back(deskew_at(scan, twist));
      map.add(Pose{}, result.points.back());
      continue;
    }
    const StampedPose before = result.poses.back();
    const double step_s = to_seconds(scan.end - before.time);
    if (step_s > longest_step_s) twist = Twist{};
    Pose pose = before.pose * twist.over(step_s);
    const Twist predicted = twist;
    std::vector<Eigen::Vector3f> points;
    for (int round = 0; round < rounds; ++round) {
      points = deskew_at(scan, twist);
      pose = register_scan(points, pose, map.planes(), own, AssociationOptions{}).T_map_imu;
      if (step_s <= longest_step_s) twist = twist_between(before.pose, pose, step_s);
    }
    const double share = agreement(points, pose, map.planes()).share;
    const bool leaps = (twist.turn_rad_s - predicted.turn_rad_s).norm() > largest_turn_step_rad_s ||
                       (twist.velocity_m_s - predicted.velocity_m_s).norm() > largest_velocity_step_m_s;
    if (share < least_share || leaps) {
      result.lost = true;
      break;
    }
    result.share.push_back(share);
    result.poses.push_back({scan.end, pose});
    map.add(pose, points);
    result.points.push_back(std::move(points));
  }
  return result;
}

}  // namespace lodestone

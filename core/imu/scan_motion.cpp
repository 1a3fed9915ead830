#include "core/imu/scan_motion.h"

#include <algorithm>

namespace lodestone {

ScanMotion::ScanMotion(const NavState& end, std::span<const ImuSample> samples)
    : T_map_end_(end.T_map_imu), gravity_(end.gravity) {
  const std::size_t count = samples.size();
  times_.resize(count);
  poses_.resize(count);
  velocities_.resize(count);
  for (std::size_t i = 0; i < count; ++i) times_[i] = samples[i].time;
  poses_.back() = end.T_map_imu;
  velocities_.back() = end.velocity;
  if (count > 1) intervals_.resize(count - 1);
  for (std::size_t i = count - 1; i > 0; --i) {
    intervals_[i - 1] = make_interval(samples[i - 1], samples[i], end.gyroscope_bias, end.accelerometer_bias);
    poses_[i - 1] = poses_[i];
    velocities_[i - 1] = velocities_[i];
    integrate(intervals_[i - 1], gravity_, -1.0, poses_[i - 1], velocities_[i - 1]);
  }
}

Pose ScanMotion::pose(Time time) const {
  if (intervals_.empty()) {
    Pose result = poses_.front();
    result.position += to_seconds(time - times_.front()) * velocities_.front();
    return result;
  }
  const auto after = std::upper_bound(times_.begin() + 1, times_.end() - 1, time);
  const std::size_t right = static_cast<std::size_t>(after - times_.begin());
  const ImuInterval& interval = intervals_[right - 1];
  Pose result = poses_[right];
  if (interval.duration_s <= 0.0) return result;
  Vector3 velocity = velocities_[right];
  integrate(interval, gravity_, to_seconds(time - times_[right]) / interval.duration_s, result, velocity);
  return result;
}

Pose ScanMotion::relative_pose(Time time) const { return T_map_end_.inverse() * pose(time); }

}  // namespace lodestone

#include "core/imu/scan_motion.h"

#include <algorithm>

#include "core/imu/hermite.h"

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

ScanMotion::ScanMotion(const NavState& before, const NavState& end, std::span<const ImuSample> samples)
    : ScanMotion(end, samples) {
  Correction correction;
  correction.step_s = to_seconds(times_.back() - times_.front());
  if (correction.step_s <= 0.0) return;
  const Quaternion to_end = end.T_map_imu.rotation.conjugate();
  correction.turn =
      so3::log(to_end * before.T_map_imu.rotation * poses_.front().rotation.conjugate() * end.T_map_imu.rotation);
  correction.shift = to_end * (before.T_map_imu.position - poses_.front().position);
  correction.velocity = to_end * (before.velocity - velocities_.front());
  correction_ = correction;
}

Pose ScanMotion::propagated(Time time) const {
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

Pose ScanMotion::relative_pose(Time time) const {
  Pose result = T_map_end_.inverse() * propagated(time);
  if (!correction_) return result;
  const Hermite basis(to_seconds(end_time() - time), correction_->step_s);
  result.rotation = so3::exp(basis.share * correction_->turn) * result.rotation;
  result.position += basis.far_position * correction_->shift - basis.far_slope * correction_->velocity;
  return result;
}

Pose ScanMotion::pose(Time time) const {
  return T_map_end_ * relative_pose(time);
}

Vector3 ScanMotion::relative_begin_velocity() const {
  const Vector3 velocity = T_map_end_.rotation.conjugate() * velocities_.front();
  return correction_ ? (velocity + correction_->velocity).eval() : velocity;
}

}  // namespace lodestone

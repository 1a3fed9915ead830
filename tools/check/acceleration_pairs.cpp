#include "tools/check/acceleration_pairs.h"

#include <cmath>
#include <optional>

#include "tools/check/vector_series.h"

namespace lodestone {
namespace {

constexpr std::size_t span = 5;  // poses between the positions of a second difference
constexpr std::size_t stride = 3;
constexpr double largest_span_s = 1.0;
constexpr Time largest_gap = 500'000'000;
constexpr std::size_t fewest_pairs = 6;

/// The specific force, rotated by the poses and integrated twice from rest.
class TwiceIntegrated {
 public:
  TwiceIntegrated(const std::vector<ImuSample>& imu, const Trajectory& poses) {
    Vector3 velocity = Vector3::Zero();
    Vector3 position = Vector3::Zero();
    Vector3 last = Vector3::Zero();
    for (const ImuSample& sample : imu) {
      const auto pose = interpolate(poses, sample.time, largest_gap);
      // During an outage, the last attitude is kept; pairs within the outage are rejected.
      if (!pose && times_.empty()) continue;
      const Vector3 force = pose ? (pose->rotation * sample.linear_acceleration).eval() : last;
      if (!times_.empty()) {
        const double step_s = to_seconds(sample.time - times_.back());
        const Vector3 mean = 0.5 * (force + last);
        position += step_s * velocity + 0.5 * step_s * step_s * mean;
        velocity += step_s * mean;
      }
      times_.push_back(sample.time);
      positions_.push_back(position);
      last = force;
    }
  }

  std::optional<Vector3> at(Time time) const {
    const auto place = place_in(times_, time, largest_gap / 10);
    return place ? std::optional<Vector3>(place->value_of(positions_)) : std::nullopt;
  }

 private:
  std::vector<Time> times_;
  std::vector<Vector3> positions_;
};

}  // namespace

std::vector<AccelerationPair> compare_accelerations(const Trajectory& poses, const std::vector<ImuSample>& imu) {
  const TwiceIntegrated forces(imu, poses);
  std::vector<AccelerationPair> pairs;
  for (std::size_t i = span; i + span < poses.size(); i += stride) {
    const StampedPose &first = poses[i - span], &middle = poses[i], &last = poses[i + span];
    const double before_s = to_seconds(middle.time - first.time);
    const double after_s = to_seconds(last.time - middle.time);
    const auto a = forces.at(first.time), b = forces.at(middle.time), c = forces.at(last.time);
    if (!a || !b || !c || before_s + after_s > 2.0 * largest_span_s) continue;
    const auto second_difference = [&](const Vector3& from, const Vector3& at, const Vector3& to) {
      return (2.0 / (before_s + after_s) * ((to - at) / after_s - (at - from) / before_s)).eval();
    };
    pairs.push_back({middle.time, middle.pose.rotation,
                     second_difference(first.pose.position, middle.pose.position, last.pose.position),
                     second_difference(*a, *b, *c)});
  }
  return pairs;
}

HeadingFit fit_heading(const Trajectory& lidar_poses, const std::vector<ImuSample>& imu,
                       const Quaternion& R_imu_lidar) {
  Trajectory poses = lidar_poses;  // poses of a frame at the LiDAR with the IMU's axes; the lever arm is neglected
  for (StampedPose& pose : poses) pose.pose.rotation = pose.pose.rotation * R_imu_lidar.conjugate();
  const std::vector<AccelerationPair> pairs = compare_accelerations(poses, imu);
  if (pairs.size() < fewest_pairs) return {};
  const auto count = static_cast<double>(pairs.size());
  Vector3 force = Vector3::Zero();
  Vector3 acceleration = Vector3::Zero();
  for (const AccelerationPair& pair : pairs) {
    force += pair.specific_force / count;
    acceleration += pair.acceleration / count;
  }
  const Vector3 up = force.normalized();
  double along = 0.0, across = 0.0, forces = 0.0, accelerations = 0.0;
  for (const AccelerationPair& pair : pairs) {
    const auto level = [&](const Vector3& vector) { return (vector - up.dot(vector) * up).eval(); };
    const Vector3 f = level(pair.specific_force - force);
    const Vector3 a = level(pair.acceleration - acceleration);
    along += a.dot(f);
    across += up.dot(a.cross(f));
    forces += f.squaredNorm();
    accelerations += a.squaredNorm();
  }
  HeadingFit fit;
  fit.turn_rad = std::atan2(across, along);
  fit.excitation_m_s2 = std::sqrt(accelerations / count);
  if (forces > 0.0 && accelerations > 0.0)
    fit.correlation = std::hypot(along, across) / std::sqrt(forces * accelerations);
  return fit;
}

}  // namespace lodestone

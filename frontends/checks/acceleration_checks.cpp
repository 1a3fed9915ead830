#include "frontends/checks/acceleration_checks.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "frontends/checks/step_search.h"

namespace lodestone {
namespace {

constexpr std::size_t span = 5;         // poses from one to the next of a second difference
constexpr std::size_t stride = 3;
constexpr std::size_t least_side = 3;   // values on either side of a step
constexpr double largest_span_s = 1.0;
constexpr double telling_bias_m_s2 = 0.4;
constexpr double telling_step_m_s2 = 0.15;
constexpr double step_sigmas = 8.0;
constexpr Time largest_gap = 500'000'000;

/// The specific force, turned to the map by the poses, integrated twice from rest.
class TwiceIntegrated {
 public:
  TwiceIntegrated(const std::vector<ImuSample>& imu, const Trajectory& poses) {
    Vector3 velocity = Vector3::Zero();
    Vector3 position = Vector3::Zero();
    Vector3 last = Vector3::Zero();
    for (const ImuSample& sample : imu) {
      const auto pose = interpolate(poses, sample.time, largest_gap);
      if (!pose) {
        if (!times_.empty()) break;
        continue;
      }
      const Vector3 force = pose->rotation * sample.linear_acceleration;
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
    const auto after = std::upper_bound(times_.begin(), times_.end(), time);
    if (after == times_.begin() || after == times_.end()) return std::nullopt;
    const auto i = static_cast<std::size_t>(after - times_.begin());
    const double share = to_seconds(time - times_[i - 1]) / to_seconds(times_[i] - times_[i - 1]);
    return positions_[i - 1] + share * (positions_[i] - positions_[i - 1]);
  }

 private:
  std::vector<Time> times_;
  std::vector<Vector3> positions_;
};

}  // namespace

Findings check_acceleration_along(const Trajectory& poses, const LogSample& sample, const Platform& platform) {
  const TwiceIntegrated forces(sample.imu, poses);
  const Vector3 gravity(0.0, 0.0, platform.suite.gravity_m_s2);
  std::vector<Vector3> biases;  // imu frame
  std::vector<Time> times;
  Vector3 mean = Vector3::Zero();
  for (std::size_t i = span; i + span < poses.size(); i += stride) {
    const StampedPose &first = poses[i - span], &middle = poses[i], &last = poses[i + span];
    const double before_s = to_seconds(middle.time - first.time);
    const double after_s = to_seconds(last.time - middle.time);
    const auto a = forces.at(first.time), b = forces.at(middle.time), c = forces.at(last.time);
    if (!a || !b || !c || before_s + after_s > 2.0 * largest_span_s) continue;
    const Vector3 along = (last.pose.position - middle.pose.position - *c + *b) / after_s -
                          (middle.pose.position - first.pose.position - *b + *a) / before_s;
    biases.push_back(-(middle.pose.rotation.conjugate() * (2.0 / (before_s + after_s) * along + gravity)));
    times.push_back(middle.time);
    mean += biases.back();
  }
  Findings findings;
  if (biases.size() < 2 * least_side) return findings;
  mean /= static_cast<double>(biases.size());
  const LargestStep step = largest_step(biases, least_side);
  if (step.step.norm() > telling_step_m_s2 && step.sigmas() > step_sigmas) {
    findings.push_back({Severity::warning, "imu.accelerometer_step",
                        fmt::format("{}: the accelerometer's bias steps by ({:.2f} {:.2f} {:.2f}) m/s2 against the way driven",
                                    platform.imu.topic, step.step.x(), step.step.y(), step.step.z()),
                        "check the IMU (shocks, temperature, power)", times[step.index]});
  } else if (mean.norm() > telling_bias_m_s2) {
    findings.push_back({Severity::warning, "imu.accelerometer_bias",
                        fmt::format("{}: the accelerometer reads ({:.2f} {:.2f} {:.2f}) m/s2 beside the way driven",
                                    platform.imu.topic, mean.x(), mean.y(), mean.z()),
                        "calibrate it, level the map, or check the rotation of lidar.T_imu_lidar", times.front()});
  }
  return findings;
}

}  // namespace lodestone

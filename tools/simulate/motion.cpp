#include "tools/simulate/motion.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/angles.h"
#include "core/random_stream.h"

namespace lodestone::simulation {
namespace {

constexpr int order = 6;  // control points per interval

/// Value and first two derivatives (by the share u of a knot interval) of the quintic basis.
struct Basis {
  std::array<double, order> value, first, second;
  explicit Basis(double u) {
    // Row k: coefficients of u⁰ … u⁵, times 120. Source: Qin 2000, general matrix representations for B-splines.
    static constexpr double matrix[order][order] = {{1, -5, 10, -10, 5, -1},  {26, -50, 20, 20, -20, 5},
                                                    {66, 0, -60, 0, 30, -10}, {26, 50, 20, -20, -20, 10},
                                                    {1, 5, 10, 10, 5, -5},    {0, 0, 0, 0, 0, 1}};
    for (int k = 0; k < order; ++k) {
      const double* c = matrix[k];
      value[k] = (c[0] + u * (c[1] + u * (c[2] + u * (c[3] + u * (c[4] + u * c[5]))))) / 120.0;
      first[k] = (c[1] + u * (2 * c[2] + u * (3 * c[3] + u * (4 * c[4] + u * 5 * c[5])))) / 120.0;
      second[k] = (2 * c[2] + u * (6 * c[3] + u * (12 * c[4] + u * 20 * c[5]))) / 120.0;
    }
  }
};

/// Gaussian noise of unit variance with a correlation time, one value per plan step.
std::vector<double> correlated_noise(std::size_t count, double correlation_s, RandomStream random) {
  const double sigma = correlation_s / plan_step_s / std::numbers::sqrt2;
  const int half = static_cast<int>(std::ceil(4.0 * sigma));
  std::vector<double> kernel(2 * half + 1), white(count + 2 * half), result(count, 0.0);
  double squares = 0.0;
  for (int k = -half; k <= half; ++k) {
    kernel[k + half] = std::exp(-0.5 * std::pow(k / std::max(sigma, 1e-3), 2));
    squares += kernel[k + half] * kernel[k + half];
  }
  for (double& value : white) value = random.normal() / std::sqrt(squares);
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t k = 0; k < kernel.size(); ++k) result[i] += kernel[k] * white[i + k];
  return result;
}

Quaternion rotation_of(const Eigen::Matrix<double, 6, 1>& channels) {
  return Eigen::AngleAxisd(channels[5], Vector3::UnitZ()) * Eigen::AngleAxisd(channels[4], Vector3::UnitY()) *
         Eigen::AngleAxisd(channels[3], Vector3::UnitX());
}

struct Interval {
  std::size_t first;
  double share;
  Interval(double seconds, std::size_t control_points) {
    const double knot = std::max(0.0, seconds / plan_step_s);
    first = std::min(static_cast<std::size_t>(knot), control_points - order);
    share = std::min(1.0, knot - static_cast<double>(first));
  }
};

}  // namespace

Motion::Motion(const std::vector<PlannedPose>& plan, double imu_height_m, const FloorOptions& floor,
               std::uint64_t seed) {
  const std::size_t count = plan.size();
  const auto slow = [&](const char* channel) {
    return correlated_noise(count, floor.slow_correlation_s, RandomStream(seed, channel));
  };
  const auto vibration = [&](const char* channel) { return correlated_noise(count, 0.0, RandomStream(seed, channel)); };
  const auto slip_x = slow("slip x"), slip_y = slow("slip y"), height = slow("height"), roll = slow("roll"),
             pitch = slow("pitch"), slip_yaw = slow("slip yaw");
  const auto shake_x = vibration("shake x"), shake_y = vibration("shake y"), shake_z = vibration("shake z"),
             shake_roll = vibration("shake roll"), shake_pitch = vibration("shake pitch");
  for (std::size_t i = 0; i < count; ++i) {
    // At rest the floor causes no disturbance; the disturbance grows with the speed up to 0.5 m/s.
    const double pace = std::min(1.0, std::abs(plan[i].speed) / 0.5);
    const double share = pace * pace * (3.0 - 2.0 * pace);
    Channels channels;
    channels << plan[i].position, imu_height_m, 0.0, 0.0, plan[i].heading;
    channels[0] += share * (floor.slip_position_sigma_m * slip_x[i] + floor.vibration_m * shake_x[i]);
    channels[1] += share * (floor.slip_position_sigma_m * slip_y[i] + floor.vibration_m * shake_y[i]);
    channels[2] += share * (floor.height_sigma_m * height[i] + floor.vibration_m * shake_z[i]);
    channels[3] += share * degree * (floor.tilt_sigma_deg * roll[i] + floor.vibration_tilt_deg * shake_roll[i]);
    channels[4] += share * degree * (floor.tilt_sigma_deg * pitch[i] + floor.vibration_tilt_deg * shake_pitch[i]);
    channels[5] += share * degree * floor.slip_yaw_sigma_deg * slip_yaw[i];
    control_points_.push_back(channels);
  }
  while (control_points_.size() < order + 1) control_points_.push_back(control_points_.back());
  duration_ = static_cast<double>(control_points_.size() - order + 1) * plan_step_s;
}

Pose Motion::pose_at(double seconds) const {
  const Interval interval(seconds, control_points_.size());
  const Basis basis(interval.share);
  Channels channels = Channels::Zero();
  for (int k = 0; k < order; ++k) channels += basis.value[k] * control_points_[interval.first + k];
  return {rotation_of(channels), channels.head<3>()};
}

MotionSample Motion::at(double seconds) const {
  const Interval interval(seconds, control_points_.size());
  const Basis basis(interval.share);
  Channels value = Channels::Zero(), rate = Channels::Zero(), second = Channels::Zero();
  for (int k = 0; k < order; ++k) {
    const Channels& point = control_points_[interval.first + k];
    value += basis.value[k] * point;
    rate += basis.first[k] / plan_step_s * point;
    second += basis.second[k] / (plan_step_s * plan_step_s) * point;
  }
  MotionSample sample;
  sample.T_map_imu = {rotation_of(value), value.head<3>()};
  sample.velocity = rate.head<3>();
  sample.acceleration = second.head<3>();
  const double sr = std::sin(value[3]), cr = std::cos(value[3]), sp = std::sin(value[4]), cp = std::cos(value[4]);
  sample.angular_velocity = {rate[3] - rate[5] * sp, rate[4] * cr + rate[5] * sr * cp,
                             -rate[4] * sr + rate[5] * cr * cp};
  return sample;
}

}  // namespace lodestone::simulation

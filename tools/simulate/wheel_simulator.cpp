#include "tools/simulate/wheel_simulator.h"

#include <cmath>

namespace lodestone::simulation {
namespace {

// Slower wheels report no counts of their encoders.
constexpr double kLeastVelocity_m_s = 1e-4;
constexpr double kLeastYawRate_rad_s = 1e-4;

}  // namespace

WheelSimulator::WheelSimulator(const Motion& motion, const WheelOptions& options, Time start_time, std::uint64_t seed,
                               const WheelErrors& errors)
    : motion_(motion),
      options_(options),
      T_imu_wheels_(with_error(options.T_imu_wheels(), errors.mounting)),
      errors_(errors),
      start_time_(start_time),
      random_(seed, "wheels") {}

std::optional<Time> WheelSimulator::next_time() const {
  if (seconds() > motion_.duration()) return std::nullopt;
  return start_time_ + from_seconds(seconds());
}

WheelSample WheelSimulator::next() {
  const MotionSample motion = motion_.at(seconds());
  const Vector3 velocity =
      motion.T_map_imu.rotation.conjugate() * motion.velocity + motion.angular_velocity.cross(T_imu_wheels_.position);
  const Vector3 rolling = T_imu_wheels_.rotation.conjugate() * velocity;
  const Vector3 turning = T_imu_wheels_.rotation.conjugate() * motion.angular_velocity;
  const double scale = errors_.scale + errors_.slip.at({seconds(), 0.0, 0.0}).x();
  // Drawn at rest, too: the noise of a later sample does not depend on the stops before.
  const double noise_m_s = options_.velocity_noise_m_s * random_.normal();
  WheelSample sample;
  sample.time = start_time_ + from_seconds(seconds());
  ++index_;
  if (std::abs(rolling.x()) < kLeastVelocity_m_s && std::abs(turning.z()) < kLeastYawRate_rad_s) return sample;
  sample.forward_velocity_m_s = scale * rolling.x() + noise_m_s;
  sample.yaw_rate_rad_s = scale * turning.z();
  return sample;
}

}  // namespace lodestone::simulation

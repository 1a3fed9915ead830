#include "tools/simulate/inertial_simulator.h"

#include <algorithm>
#include <cmath>

namespace lodestone::simulation {

ImuSample ideal_imu(const Motion& motion, double seconds, double gravity_m_s2) {
  const MotionSample truth = motion.at(seconds);
  ImuSample sample;
  sample.angular_velocity = truth.angular_velocity;
  sample.linear_acceleration =
      truth.T_map_imu.rotation.conjugate() * (truth.acceleration + gravity_m_s2 * Vector3::UnitZ());
  return sample;
}

ImuSimulator::ImuSimulator(const Motion& motion, const ImuOptions& options, double gravity_m_s2, Time start_time,
                           std::uint64_t seed, const ImuErrors& errors)
    : motion_(motion),
      options_(options),
      gravity_(gravity_m_s2),
      errors_(errors),
      start_time_(start_time),
      random_(seed, "imu") {
  gyroscope_bias_ = options.gyroscope_bias_sigma_rad_s * random_.normal3();
  accelerometer_bias_ = options.accelerometer_bias_sigma_m_s2 * random_.normal3();
}

std::optional<Time> ImuSimulator::next_time() const {
  if (seconds() > motion_.duration()) return std::nullopt;
  return start_time_ + from_seconds(seconds());
}

ImuSample ImuSimulator::next() {
  ImuSample sample = ideal_imu(motion_, seconds(), gravity_);
  sample.time = start_time_ + from_seconds(seconds());
  sample.angular_velocity = errors_.gyroscope * sample.angular_velocity;
  sample.linear_acceleration = errors_.accelerometer * sample.linear_acceleration;
  // White noise of a sample is density · √rate; the step of a random walk is density / √rate.
  const double root_rate = std::sqrt(options_.rate_hz);
  sample.angular_velocity +=
      gyroscope_bias_ + options_.gyroscope_noise_density_rad_s_sqrt_hz * root_rate * random_.normal3();
  sample.linear_acceleration +=
      accelerometer_bias_ + options_.accelerometer_noise_density_m_s2_sqrt_hz * root_rate * random_.normal3();
  gyroscope_bias_ += options_.gyroscope_bias_random_walk_rad_s2_sqrt_hz / root_rate * random_.normal3();
  accelerometer_bias_ += options_.accelerometer_bias_random_walk_m_s3_sqrt_hz / root_rate * random_.normal3();
  ++index_;
  return sample;
}

MagnetometerSimulator::MagnetometerSimulator(const Motion& motion, const MagneticField& field,
                                             const MagnetometerOptions& options, Time start_time, std::uint64_t seed,
                                             ArrayErrors errors)
    : motion_(motion),
      field_(field),
      options_(options),
      errors_(std::move(errors)),
      start_time_(start_time),
      seed_(seed) {
  const double span = (motion.duration() - options.offset_s) * options.rate_hz;
  sample_count_ = options.mounts.empty() ? 0 : std::max(0, 1 + static_cast<int>(std::floor(span)));
}

Time MagnetometerSimulator::time(int index) const {
  return start_time_ + from_seconds(seconds(index)) + from_seconds(errors_.clock_offset_s);
}

Vector3 MagnetometerSimulator::with_errors(std::size_t magnetometer, double seconds, const Vector3& field_ut) const {
  if (errors_.magnetometers.empty()) return field_ut;
  const MagnetometerErrors& errors = errors_.magnetometers[magnetometer];
  const DriveCommand command = errors_.command ? errors_.command(seconds) : DriveCommand{};
  const Vector3 motors =
      command.acceleration_m_s2 * errors.acceleration_field + command.yaw_rate_rad_s * errors.turning_field;
  return errors.matrix * (field_ut + motors) + errors.offset_ut;
}

std::vector<MagneticSample> MagnetometerSimulator::read(int index) const {
  RandomStream random(seed_, "magnetometers", static_cast<std::uint64_t>(index));
  const Pose T_map_imu = motion_.pose_at(seconds(index));
  std::vector<MagneticSample> samples(options_.mounts.size());
  for (std::size_t j = 0; j < samples.size(); ++j) {
    const Pose believed = options_.mounts[j].T_imu_mag();
    const Pose T_map_mag =
        T_map_imu *
        (errors_.magnetometers.empty() ? believed : with_error(believed, errors_.magnetometers[j].mounting));
    Vector3 field_ut = field_.field_ut(T_map_mag.position);
    if (errors_.field) field_ut += errors_.field(seconds(index), T_map_mag.position);
    samples[j].time = time(index);
    samples[j].magnetometer = static_cast<int>(j);
    samples[j].field_ut = with_errors(j, seconds(index), T_map_mag.rotation.conjugate() * field_ut) +
                          options_.noise_ut * random.normal3();
  }
  return samples;
}

}  // namespace lodestone::simulation

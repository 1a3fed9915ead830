#pragma once

#include <cstdint>
#include <optional>

#include "core/measurements.h"
#include "tools/simulate/magnetic_field.h"
#include "tools/simulate/motion.h"
#include "tools/simulate/random.h"

namespace lodestone::simulation {

/// What an ideal IMU reads: rotation rate and specific force in imu axes, exactly at `seconds`.
ImuSample ideal_imu(const Motion& motion, double seconds, double gravity_m_s2);

/// The IMU: the motion's derivatives plus bias (a random walk from a random start) and white noise.
class ImuSimulator {
 public:
  ImuSimulator(const Motion& motion, const ImuOptions& options, double gravity_m_s2, Time start_time,
               std::uint64_t seed);

  std::optional<Time> next_time() const;
  ImuSample next();

 private:
  double seconds() const { return static_cast<double>(index_) / options_.rate_hz; }

  const Motion& motion_;
  ImuOptions options_;
  double gravity_;
  Time start_time_;
  RandomStream random_;
  Vector3 gyroscope_bias_;
  Vector3 accelerometer_bias_;
  std::int64_t index_ = 0;
};

/// All magnetometers, read at one instant: the field where each is, in its own axes, plus white noise.
class MagnetometerSimulator {
 public:
  MagnetometerSimulator(const Motion& motion, const MagneticField& field, const MagnetometerOptions& options,
                        Time start_time, std::uint64_t seed);

  int sample_count() const { return sample_count_; }
  Time time(int index) const;

  /// The readings of every magnetometer; depends on (seed, index) alone. Thread-safe.
  std::vector<MagneticSample> read(int index) const;

 private:
  double seconds(int index) const { return options_.offset_s + index / options_.rate_hz; }

  const Motion& motion_;
  const MagneticField& field_;
  MagnetometerOptions options_;
  Time start_time_;
  std::uint64_t seed_;
  int sample_count_ = 0;
};

}  // namespace lodestone::simulation

#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "core/measurements.h"
#include "core/random_stream.h"
#include "tools/simulate/magnetic_field.h"
#include "tools/simulate/motion.h"
#include "tools/simulate/reality.h"
#include "tools/simulate/route.h"

namespace lodestone::simulation {

/// Readings of an ideal IMU: rotation rate and specific force in imu axes, exactly at `seconds`.
ImuSample ideal_imu(const Motion& motion, double seconds, double gravity_m_s2);

/// The IMU: the motion's derivatives times the axis-error matrices, plus bias (a random walk from a random start) and
/// white noise.
class ImuSimulator {
 public:
  ImuSimulator(const Motion& motion, const ImuOptions& options, double gravity_m_s2, Time start_time,
               std::uint64_t seed, const ImuErrors& errors = {});

  std::optional<Time> next_time() const;
  ImuSample next();

 private:
  double seconds() const { return static_cast<double>(index_) / options_.rate_hz; }

  const Motion& motion_;
  ImuOptions options_;
  double gravity_;
  ImuErrors errors_;
  Time start_time_;
  RandomStream random_;
  Vector3 gyroscope_bias_;
  Vector3 accelerometer_bias_;
  std::int64_t index_ = 0;
};

/// Errors of a magnetometer array against platform.yaml, and additional sources of field.
struct ArrayErrors {
  std::vector<MagnetometerErrors> magnetometers;          ///< one per magnetometer; empty: no errors
  double clock_offset_s = 0.0;                            ///< stamp = true time + this
  std::function<DriveCommand(double seconds)> command{};  ///< commanded motion of the motors; empty: no command
  std::function<Vector3(double seconds, const Vector3&)> field{};  ///< of moving objects, map, µT; empty: none
};

/// All magnetometers, read at one instant: the field at each sensor, in sensor axes, with errors and white noise.
class MagnetometerSimulator {
 public:
  MagnetometerSimulator(const Motion& motion, const MagneticField& field, const MagnetometerOptions& options,
                        Time start_time, std::uint64_t seed, ArrayErrors errors = {});

  int sample_count() const { return sample_count_; }

  /// Stamp: the true time plus the clock offset.
  Time time(int index) const;

  /// The readings of all magnetometers; depends on (seed, index) alone. Thread-safe.
  std::vector<MagneticSample> read(int index) const;

 private:
  Vector3 with_errors(std::size_t magnetometer, double seconds, const Vector3& field_ut) const;
  double seconds(int index) const { return options_.offset_s + index / options_.rate_hz; }

  const Motion& motion_;
  const MagneticField& field_;
  MagnetometerOptions options_;
  ArrayErrors errors_;
  Time start_time_;
  std::uint64_t seed_;
  int sample_count_ = 0;
};

}  // namespace lodestone::simulation

#pragma once

#include <cstdint>
#include <optional>

#include "core/measurements.h"
#include "core/random_stream.h"
#include "tools/simulate/motion.h"
#include "tools/simulate/reality.h"

namespace lodestone::simulation {

/// Wheel odometry: the true forward velocity and yaw rate of the wheel frame, times scale and slip, with white noise.
/// Wheels at rest report exactly zero, and no robot reports a lateral velocity.
class WheelSimulator {
 public:
  WheelSimulator(const Motion& motion, const WheelOptions& options, Time start_time, std::uint64_t seed,
                 const WheelErrors& errors = {});

  std::optional<Time> next_time() const;
  WheelSample next();

 private:
  double seconds() const { return static_cast<double>(index_) / options_.rate_hz; }

  const Motion& motion_;
  WheelOptions options_;
  Pose T_imu_wheels_;
  WheelErrors errors_;
  Time start_time_;
  RandomStream random_;
  std::int64_t index_ = 0;
};

}  // namespace lodestone::simulation

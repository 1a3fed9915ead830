#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/geometry/pose.h"
#include "tools/simulate/route.h"

namespace lodestone::simulation {

/// Ground truth at one time.
struct MotionSample {
  Pose T_map_imu;
  Vector3 velocity = Vector3::Zero();          ///< map axes, m/s
  Vector3 acceleration = Vector3::Zero();      ///< map axes, m/s², without gravity
  Vector3 angular_velocity = Vector3::Zero();  ///< imu axes, rad/s
};

/// The true motion of the IMU: one uniform quintic B-spline in x, y, z, roll, pitch and yaw (R = Rz Ry Rx), four times
/// continuously differentiable, with exact derivatives. Its control points are the planned drive plus the disturbances
/// by the floor. Immutable; queries are thread-safe.
class Motion {
 public:
  Motion(const std::vector<PlannedPose>& plan, double imu_height_m, const FloorOptions& floor, std::uint64_t seed);

  /// `seconds` since the start, clamped to [0, duration].
  MotionSample at(double seconds) const;
  Pose pose_at(double seconds) const;
  double duration() const { return duration_; }

 private:
  using Channels = Eigen::Matrix<double, 6, 1>;  ///< x, y, z, roll, pitch, yaw
  std::vector<Channels> control_points_;
  double duration_ = 0.0;
};

}  // namespace lodestone::simulation

#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "core/geometry/pose.h"
#include "core/measurements.h"
#include "core/options.h"

namespace lodestone {
class ConfigurationNode;
}

/// Faults of a robot's sensors, and disturbances that pass the robot, during a drive. Maps, survey and platform file
/// are those of the healthy robot.
namespace lodestone::simulation {

enum class FaultKind {
  hard_iron,      ///< a constant field is added, sensor axes
  soft_iron,      ///< the reading is multiplied by a matrix
  misalignment,   ///< the sensor is rotated against its pose in the platform file
  bias_drift,     ///< an offset that grows while the fault lasts, and stays afterwards
  dead,           ///< no messages
  stuck,          ///< the first value repeats
  saturated,      ///< components are clipped
  spikes,         ///< single readings are outliers
  lidar_outage,   ///< no scans, or empty ones
  imu_gap,        ///< no IMU samples
  imu_bias_jump,  ///< both biases of the IMU jump, and stay
  clock_offset,   ///< stamps of a sensor are off
  passing_steel,  ///< a moving dipole: a steel cart, a forklift
  slip            ///< the wheels report too much, or too little
};

constexpr auto enum_names(FaultKind) {
  return EnumNames<FaultKind, 14>{{{FaultKind::hard_iron, "hard_iron"},
                                   {FaultKind::soft_iron, "soft_iron"},
                                   {FaultKind::misalignment, "misalignment"},
                                   {FaultKind::bias_drift, "bias_drift"},
                                   {FaultKind::dead, "dead"},
                                   {FaultKind::stuck, "stuck"},
                                   {FaultKind::saturated, "saturated"},
                                   {FaultKind::spikes, "spikes"},
                                   {FaultKind::lidar_outage, "lidar_outage"},
                                   {FaultKind::imu_gap, "imu_gap"},
                                   {FaultKind::imu_bias_jump, "imu_bias_jump"},
                                   {FaultKind::clock_offset, "clock_offset"},
                                   {FaultKind::passing_steel, "passing_steel"},
                                   {FaultKind::slip, "slip"}}};
}

/// One fault, active over [begin_s, end_s). Times are seconds after the log's begin by the true clock.
struct Fault {
  FaultKind kind = FaultKind::hard_iron;
  double begin_s = 0.0;
  double end_s = std::numeric_limits<double>::infinity();
  std::vector<int> magnetometers;                ///< affected magnetometers; clock_offset: those whose stamps are off
  Vector3 offset_ut = Vector3::Zero();           ///< hard_iron
  Matrix3 matrix = Matrix3::Identity();          ///< soft_iron: factor of readings; misalignment: Rᵀ of rotation R
  Vector3 rate_ut_s = Vector3::Zero();           ///< bias_drift
  double random_walk_ut_sqrt_s = 0.0;            ///< bias_drift: one sigma per component after 1 s
  double limit_ut = 0.0;                         ///< saturated: components stay within ± this
  double rate_per_s = 0.0;                       ///< spikes: mean rate
  double size_ut = 0.0;                          ///< spikes: length of each, in a random direction
  bool empty_scans = false;                      ///< lidar_outage: scans without points instead of none
  Vector3 gyroscope_rad_s = Vector3::Zero();     ///< imu_bias_jump
  Vector3 accelerometer_m_s2 = Vector3::Zero();  ///< imu_bias_jump
  bool imu_clock = false;                        ///< clock_offset: the IMU's stamps are off
  bool lidar_clock = false;                      ///< clock_offset: the scans' stamps are off
  Time clock_offset = 0;                         ///< added to stamps
  Vector3 from_m = Vector3::Zero();              ///< passing_steel: position at begin_s (map); constant velocity
  Vector3 to_m = Vector3::Zero();                ///< passing_steel: position at end_s (map)
  Vector3 moment_a_m2 = Vector3::Zero();         ///< passing_steel: map axes
  double slip = 0.0;                             ///< slip: share of the true velocity that is reported in addition
};

/// Reads a list of faults. `magnetometers`: names in the order of the suite; `has_wheels`: whether the robot has wheel
/// odometry. Throws InputError with file, line, key and correction.
std::vector<Fault> read_faults(const ConfigurationNode& list, const std::vector<std::string>& magnetometers,
                               bool has_wheels);

/// Puts faults into a stream of measurements. Faults act in the order of their list; stamps are shifted last.
/// Measurements without a fault keep their bits. Passing steel is invisible to LiDAR. The same faults, seed and stream
/// give the same bits.
class FaultInjector {
 public:
  /// T_map_mag of a magnetometer, `seconds` after the log's begin.
  using MagnetometerPose = std::function<Pose(int magnetometer, double seconds)>;

  /// `start`: the log's begin. `where`: required by passing_steel only.
  FaultInjector(std::vector<Fault> faults, Time start, std::uint64_t seed, MagnetometerPose where = {});
  ~FaultInjector();

  /// Adds the next healthy measurement, in order of completion.
  void push(Measurement&& measurement);

  /// Declares the end of the stream.
  void end();

  /// The next recorded measurement, in order of completion by the recorded stamps. Returns false if a later push() may
  /// still precede it.
  bool pop(Measurement& measurement);

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace lodestone::simulation

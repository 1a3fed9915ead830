#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "core/geometry/so3.h"
#include "core/time.h"

namespace lodestone {

/// One reading of the IMU, in the imu frame.
struct ImuSample {
  Time time = 0;
  Vector3 angular_velocity = Vector3::Zero();     ///< rad/s
  Vector3 linear_acceleration = Vector3::Zero();  ///< m/s², specific force: +g upwards at rest
};

/// One reading of one magnetometer, in that magnetometer's frame.
struct MagneticSample {
  Time time = 0;
  int magnetometer = 0;                ///< index into SensorSuite::magnetometers
  Vector3 field_ut = Vector3::Zero();  ///< µT
};

/// Velocity of the robot as its wheels measure it, in the wheel frame: x forwards, y left, z up.
struct WheelSample {
  Time time = 0;
  double forward_velocity_m_s = 0.0;
  double lateral_velocity_m_s = 0.0;  ///< to the left; 0 from robots that cannot measure it
  double yaw_rate_rad_s = 0.0;
};

/// One point of a scan, in the (first) LiDAR's frame at the point's own time.
struct LidarPoint {
  Eigen::Vector3f position = Eigen::Vector3f::Zero();  ///< metres
  float intensity = 0.0F;
  std::int32_t offset_ns = 0;  ///< the point's time minus the scan's start time
  std::uint16_t ring = 0;
  std::uint8_t lidar = 0;  ///< index in SensorSuite::lidars() of the LiDAR that measured the point: 0 is the first
};

// A log's scans have millions of points.
static_assert(sizeof(LidarPoint) == 24);

/// Number of values of LidarPoint::lidar.
inline constexpr std::size_t kMostLidars = 256;

/// One revolution (or frame) of the LiDAR. Points in the order of the message.
struct LidarScan {
  Time start = 0;  ///< time of offset 0
  Time end = 0;    ///< t_k: start + the largest offset (start + the nominal period if no point has an offset)
  std::vector<LidarPoint> points;
};

using Measurement = std::variant<ImuSample, MagneticSample, LidarScan, WheelSample>;

/// The time at which a measurement is complete: a scan's end, else the sample's stamp.
inline Time completion_time(const Measurement& measurement) {
  if (const auto* scan = std::get_if<LidarScan>(&measurement)) return scan->end;
  if (const auto* imu = std::get_if<ImuSample>(&measurement)) return imu->time;
  if (const auto* wheels = std::get_if<WheelSample>(&measurement)) return wheels->time;
  return std::get<MagneticSample>(measurement).time;
}

/// Readings of all magnetometers at one time (synchronized by hardware, or by the synchronizer).
struct MagneticArraySample {
  Time time = 0;
  std::vector<std::optional<Vector3>> field_ut;  ///< µT, one entry for each magnetometer of the suite; empty if missing
};

/// Input of an estimator for one step: the scan and all measurements in (previous end, end].
struct ScanBundle {
  LidarScan scan;  ///< points may be empty (an outage); start and end are still valid
  /// From the previous scan's end to this one's, both included (interpolated there). The first bundle of a log has the
  /// samples from the scan's start on.
  std::vector<ImuSample> imu;
  std::vector<MagneticArraySample> magnetic;  ///< in (previous end, end], in order of time
  std::vector<WheelSample> wheels{};          ///< the same
  double imu_gap_s = 0.0;  ///< longest time between measured samples of the IMU that overlaps the bundle
  /// The scan's points for registration, if the reader has chosen them already, with the options of the run.
  std::optional<std::vector<LidarPoint>> sampled{};
};

}  // namespace lodestone

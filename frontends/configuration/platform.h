#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/options.h"
#include "core/sensor_suite.h"
#include "frontends/configuration/sensor_choice.h"

namespace lodestone {

/// The time within a scan that the stamp of its message refers to.
enum class ScanStamp { start, middle, end };

constexpr auto enum_names(ScanStamp) {
  return EnumNames<ScanStamp, 3>{{{ScanStamp::start, "start"}, {ScanStamp::middle, "middle"}, {ScanStamp::end, "end"}}};
}

/// Unit of the per-point time.
enum class PointTimeUnit { seconds, milliseconds, microseconds, nanoseconds };

constexpr auto enum_names(PointTimeUnit) {
  return EnumNames<PointTimeUnit, 4>{{{PointTimeUnit::seconds, "s"},
                                      {PointTimeUnit::milliseconds, "ms"},
                                      {PointTimeUnit::microseconds, "us"},
                                      {PointTimeUnit::nanoseconds, "ns"}}};
}

/// The time that a per-point time of 0 refers to.
enum class PointTimeZero {
  scan_start,  ///< the scan's first point, whose time follows from the stamp
  stamp,       ///< the stamp; earlier points have negative times
  epoch,       ///< the epoch of the stamps (1970): absolute times of the same clock
  lidar_clock  ///< arbitrary: the LiDAR's own clock, of which only differences are used; the stamp defines the scan's
               ///< time
};

constexpr auto enum_names(PointTimeZero) {
  return EnumNames<PointTimeZero, 4>{{{PointTimeZero::scan_start, "scan_start"},
                                      {PointTimeZero::stamp, "stamp"},
                                      {PointTimeZero::epoch, "epoch"},
                                      {PointTimeZero::lidar_clock, "lidar_clock"}}};
}

/// Source of the points' times.
enum class PointTimes {
  field,  ///< a field of the message, named in the file or inferred
  none    ///< the driver deskews the scan: all points have the time of the stamp; no field is used
};

constexpr auto enum_names(PointTimes) {
  return EnumNames<PointTimes, 2>{{{PointTimes::field, "field"}, {PointTimes::none, "none"}}};
}

/// Layout of a LiDAR's PointCloud2; of Livox' CustomMsg only topic and stamp apply. x, y, z are metres in the lidar
/// frame. Missing entries are inferred from the first scan (point_times.h).
struct LidarMessageLayout {
  std::string topic = "/ouster/points";
  std::optional<ScanStamp> stamp = ScanStamp::start;
  std::string intensity_field = "intensity";  ///< empty: the message has none, or has no named time field
  std::string ring_field = "ring";            ///< the same
  std::string time_field = "t";
  std::optional<PointTimeUnit> time_unit = PointTimeUnit::nanoseconds;
  std::optional<PointTimeZero> time_zero;
  PointTimes point_times = PointTimes::field;  ///< none: time_field, time_unit and time_zero are ignored
  double clock_offset_s = 0.0;                 ///< stamp minus IMU time of the same instant; StreamDecoder subtracts it
};

/// Unit of an Imu message's acceleration. The standard is m/s², but some drivers use others.
enum class AccelerationUnit { metres_per_second_squared, standard_gravity };

constexpr auto enum_names(AccelerationUnit) {
  return EnumNames<AccelerationUnit, 2>{
      {{AccelerationUnit::metres_per_second_squared, "m/s2"}, {AccelerationUnit::standard_gravity, "g"}}};
}

/// Unit of a magnetometer's message. The standard of MagneticField is tesla, but some drivers use others.
enum class FieldUnit { tesla, microtesla, nanotesla, gauss, milligauss };

constexpr auto enum_names(FieldUnit) {
  return EnumNames<FieldUnit, 5>{{{FieldUnit::tesla, "tesla"},
                                  {FieldUnit::microtesla, "microtesla"},
                                  {FieldUnit::nanotesla, "nanotesla"},
                                  {FieldUnit::gauss, "gauss"},
                                  {FieldUnit::milligauss, "milligauss"}}};
}

/// Factor from this unit to µT.
double microtesla_per(FieldUnit unit);

struct ImuMessageLayout {
  std::string topic = "/imu/data";
  AccelerationUnit acceleration_unit = AccelerationUnit::metres_per_second_squared;
  /// For messages other than sensor_msgs/Imu: paths of the vectors (logs/message_paths.h), rad/s and acceleration_unit.
  std::string angular_velocity_path, linear_acceleration_path;
};

/// Location of a magnetometer in the log, and the calibration of its readings: field = soft_iron_correction (reading −
/// hard_iron_ut), in its own axes. `lodestone calibrate magnetometers` estimates both; the log reader applies them.
struct MagnetometerMessageLayout {
  std::string topic;
  FieldUnit unit = FieldUnit::tesla;
  std::string path{};  ///< of the vector in messages other than sensor_msgs/MagneticField (logs/message_paths.h)
  Vector3 hard_iron_ut = Vector3::Zero();
  Matrix3 soft_iron_correction = Matrix3::Identity();

  bool calibrated() const { return hard_iron_ut != Vector3::Zero() || soft_iron_correction != Matrix3::Identity(); }
};

/// Location of the wheel odometry in the log.
struct WheelMessageLayout {
  std::string topic = "/odom";
  /// For messages other than nav_msgs/Odometry: paths of the vectors (logs/message_paths.h), m/s and rad/s.
  std::string linear_velocity_path{}, angular_velocity_path{};
  /// Instead, for a wheel on each side: paths of a number, with '-' before a path for the opposite sign.
  std::string left_path{}, right_path{};
  bool positions = false;       ///< the numbers are positions, not velocities
  double track_m = 0.0;         ///< distance of the two wheels
  double scale = 1.0;           ///< reported velocity over true velocity; StreamDecoder divides by it
  double clock_offset_s = 0.0;  ///< sign as LidarMessageLayout::clock_offset_s
};

/// A robot: the location of each sensor in its log, and the sensor models.
struct Platform {
  std::string name;
  std::string file;  ///< source file, for messages; may be empty
  LidarMessageLayout lidar;
  ImuMessageLayout imu;
  std::vector<MagnetometerMessageLayout> magnetometers;  ///< one per magnetometer of the suite, in its order
  std::vector<LidarMessageLayout> further_lidars;        ///< usually empty; one for each of the suite, in its order
  double magnetometer_clock_offset_s = 0.0;  ///< of all magnetometers; sign as LidarMessageLayout::clock_offset_s
  WheelMessageLayout wheels{};               ///< used only if the suite has wheels
  std::vector<std::string> guesses{};        ///< keys whose values nobody measured; `lodestone init` lists them
  SensorSuite suite;

  /// False: the file has no section `lidar`.
  bool has_lidar() const { return !lidar.topic.empty(); }

  /// Name for messages.
  std::string file_name() const { return file.empty() ? "the platform file" : file; }
};

/// Reads a platform file (config/platforms/). Throws InputError, with file and line, for missing or unknown keys,
/// values of the wrong type and values out of range. The keys of LiDAR and IMU may be missing if they are not
/// `required`; these sensors then have default values, which the caller must not use.
Platform load_platform(const std::string& path, const SensorChoice& required = {});

/// Throws InputError as load_platform does; `name` replaces the file name in messages.
Platform parse_platform(const std::string& text, const std::string& name, const SensorChoice& required = {});

/// Writes a file that load_platform reads back to the same bits (temporary file, then rename). Each line of `comment`
/// becomes a comment at the begin of the file. Throws InputError.
void save_platform(const Platform& platform, const std::string& path, const std::string& comment = {});

}  // namespace lodestone

#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/options.h"
#include "core/sensor_suite.h"

namespace lodestone {

/// Which instant of a scan its message's stamp names.
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

/// What a per-point time of 0 means.
enum class PointTimeZero {
  scan_start,  ///< the scan's first firing; the stamp says when that was
  stamp,       ///< the stamp: times before it are negative
  epoch,       ///< that of the stamps (1970): times are absolute, by the same clock
  lidar_clock  ///< anything: the LiDAR's own clock, of which only differences count; the stamp places the scan
};

constexpr auto enum_names(PointTimeZero) {
  return EnumNames<PointTimeZero, 4>{{{PointTimeZero::scan_start, "scan_start"},
                                      {PointTimeZero::stamp, "stamp"},
                                      {PointTimeZero::epoch, "epoch"},
                                      {PointTimeZero::lidar_clock, "lidar_clock"}}};
}

/// Where each point's own time comes from.
enum class PointTimes {
  field,  ///< a field of the message, named or inferred
  none    ///< the driver has deskewed the scan: all points are those of the stamp's instant, no field is read
};

constexpr auto enum_names(PointTimes) {
  return EnumNames<PointTimes, 2>{{{PointTimes::field, "field"}, {PointTimes::none, "none"}}};
}

/// How a LiDAR's PointCloud2 is to be read; of Livox' CustomMsg only topic and stamp count. x, y, z are metres in the
/// lidar frame. What is left out is told from the first scan (point_times.h).
struct LidarMessageLayout {
  std::string topic = "/ouster/points";
  std::optional<ScanStamp> stamp = ScanStamp::start;
  std::string intensity_field = "intensity";  ///< empty: the message has none, or is without a named time field
  std::string ring_field = "ring";            ///< the same
  std::string time_field = "t";
  std::optional<PointTimeUnit> time_unit = PointTimeUnit::nanoseconds;
  std::optional<PointTimeZero> time_zero;
  PointTimes point_times = PointTimes::field;  ///< none: time_field, time_unit and time_zero are not used
  double clock_offset_s = 0.0;  ///< stamp less the IMU's time of the same instant; StreamDecoder subtracts it
};

/// Unit of an Imu message's acceleration. The message's definition says m/s²; not every driver does.
enum class AccelerationUnit { metres_per_second_squared, standard_gravity };

constexpr auto enum_names(AccelerationUnit) {
  return EnumNames<AccelerationUnit, 2>{
      {{AccelerationUnit::metres_per_second_squared, "m/s2"}, {AccelerationUnit::standard_gravity, "g"}}};
}

/// Unit of a magnetometer's message. MagneticField's definition says tesla; not every driver does.
enum class FieldUnit { tesla, microtesla, nanotesla, gauss, milligauss };

constexpr auto enum_names(FieldUnit) {
  return EnumNames<FieldUnit, 5>{{{FieldUnit::tesla, "tesla"},
                                  {FieldUnit::microtesla, "microtesla"},
                                  {FieldUnit::nanotesla, "nanotesla"},
                                  {FieldUnit::gauss, "gauss"},
                                  {FieldUnit::milligauss, "milligauss"}}};
}

/// Factor that brings values of this unit to µT.
double microtesla_per(FieldUnit unit);

struct ImuMessageLayout {
  std::string topic = "/imu/data";
  AccelerationUnit acceleration_unit = AccelerationUnit::metres_per_second_squared;
  /// Of a message that is no sensor_msgs/Imu: paths of its vectors (logs/message_paths.h), rad/s and acceleration_unit.
  std::string angular_velocity_path, linear_acceleration_path;
};

/// Where a log keeps a magnetometer, and what makes its readings the field: field = soft_iron_correction (reading −
/// hard_iron_ut), in its own axes. `lodestone calibrate magnetometers` finds both; the log's reader takes them off.
struct MagnetometerMessageLayout {
  std::string topic;
  FieldUnit unit = FieldUnit::tesla;
  std::string path{};  ///< of the vector in a message that is no sensor_msgs/MagneticField (logs/message_paths.h)
  Vector3 hard_iron_ut = Vector3::Zero();
  Matrix3 soft_iron_correction = Matrix3::Identity();

  bool calibrated() const { return hard_iron_ut != Vector3::Zero() || soft_iron_correction != Matrix3::Identity(); }
};

/// A robot: where its log keeps each sensor, and what the sensors are.
struct Platform {
  std::string name;
  std::string file;  ///< where it was read from, for messages; may be empty
  LidarMessageLayout lidar;
  ImuMessageLayout imu;
  std::vector<MagnetometerMessageLayout> magnetometers;  ///< one a magnetometer of the suite, in its order
  std::vector<LidarMessageLayout> further_lidars;        ///< mostly none; one for each of the suite, in its order
  double magnetometer_clock_offset_s = 0.0;  ///< of all magnetometers; sign as LidarMessageLayout::clock_offset_s
  SensorSuite suite;

  /// For messages.
  std::string file_name() const { return file.empty() ? "the platform file" : file; }
};

/// Reads a platform file (config/platforms/). Throws InputError, with file and line, for whatever is missing, misspelt,
/// of the wrong type or out of range.
Platform load_platform(const std::string& path);

/// Throws InputError as load_platform does; `name` stands for the file in messages.
Platform parse_platform(const std::string& text, const std::string& name);

/// Writes a file that load_platform reads back to the same bits; aside, then renamed. Each line of `comment` becomes a
/// comment at the file's begin. Throws InputError.
void save_platform(const Platform& platform, const std::string& path, const std::string& comment = {});

}  // namespace lodestone

#pragma once

#include <string>
#include <vector>

#include "core/options.h"
#include "core/sensor_suite.h"

namespace lodestone {

/// Which instant of a scan its message's stamp names.
enum class ScanStamp { start, end };

constexpr auto enum_names(ScanStamp) {
  return EnumNames<ScanStamp, 2>{{{ScanStamp::start, "start"}, {ScanStamp::end, "end"}}};
}

/// Unit of the per-point time.
enum class PointTimeUnit { seconds, milliseconds, microseconds, nanoseconds };

constexpr auto enum_names(PointTimeUnit) {
  return EnumNames<PointTimeUnit, 4>{{{PointTimeUnit::seconds, "s"},
                                      {PointTimeUnit::milliseconds, "ms"},
                                      {PointTimeUnit::microseconds, "us"},
                                      {PointTimeUnit::nanoseconds, "ns"}}};
}

/// How a LiDAR's PointCloud2 is to be read; of Livox' CustomMsg only topic and stamp count. x, y, z are metres in the lidar frame.
struct LidarMessageLayout {
  std::string topic = "/ouster/points";
  ScanStamp stamp = ScanStamp::start;
  std::string intensity_field = "intensity";  ///< empty: the message has none
  std::string ring_field = "ring";            ///< empty: the message has none
  std::string time_field = "t";  ///< from the stamp; or absolute time where the field's values are that large;
                                 ///< empty: a Livox, whose messages tell themselves what they hold
  PointTimeUnit time_unit = PointTimeUnit::nanoseconds;
};

/// Unit of an Imu message's acceleration. The message's definition says m/s²; not every driver does.
enum class AccelerationUnit { metres_per_second_squared, standard_gravity };

constexpr auto enum_names(AccelerationUnit) {
  return EnumNames<AccelerationUnit, 2>{
      {{AccelerationUnit::metres_per_second_squared, "m/s2"}, {AccelerationUnit::standard_gravity, "g"}}};
}

/// Unit of a MagneticField message. The message's definition says tesla; not every driver does.
enum class FieldUnit { tesla, microtesla, gauss };

constexpr auto enum_names(FieldUnit) {
  return EnumNames<FieldUnit, 3>{
      {{FieldUnit::tesla, "tesla"}, {FieldUnit::microtesla, "microtesla"}, {FieldUnit::gauss, "gauss"}}};
}

/// Factor that brings values of this unit to µT.
double microtesla_per(FieldUnit unit);

struct ImuMessageLayout {
  std::string topic = "/imu/data";
  AccelerationUnit acceleration_unit = AccelerationUnit::metres_per_second_squared;
};

struct MagnetometerMessageLayout {
  std::string topic;
  FieldUnit unit = FieldUnit::tesla;
};

/// A robot: where its log keeps each sensor, and what the sensors are.
struct Platform {
  std::string name;
  std::string file;  ///< where it was read from, for messages; may be empty
  LidarMessageLayout lidar;
  ImuMessageLayout imu;
  std::vector<MagnetometerMessageLayout> magnetometers;  ///< one a magnetometer of the suite, in its order
  SensorSuite suite;
};

/// Reads a platform file (config/platforms/). Throws InputError, with file and line, for whatever is missing, misspelt,
/// of the wrong type or out of range.
Platform load_platform(const std::string& path);

/// Throws InputError as load_platform does; `name` stands for the file in messages.
Platform parse_platform(const std::string& text, const std::string& name);

/// Writes a file that load_platform reads back to the same bits; aside, then renamed. Throws InputError.
void save_platform(const Platform& platform, const std::string& path);

}  // namespace lodestone

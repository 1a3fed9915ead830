#pragma once

#include <algorithm>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include "tests/frontends/messages/cloud_layout.h"

/// Clouds with the layouts of vendors' drivers: fields, their order, types and offsets, gaps, rows and no-returns.
namespace lodestone::testing {

enum class FieldRole { x, y, z, intensity, ring, time, seconds, nanoseconds, other };

struct VendorField {
  const char* name;
  std::uint8_t datatype;
  std::uint32_t offset;
  FieldRole role = FieldRole::other;
};

/// Order of a scan's points.
enum class Arrangement { firing_order, rings_with_zeros, rings_with_nan };

struct VendorCloud {
  const char* name;
  std::vector<VendorField> fields;
  std::uint32_t point_step;
  PointTimeUnit unit;
  std::vector<PointTimeZero> zeros;  ///< what this driver can be set to

  /// `scan`: in the order of its rows, or of firing. `data` must outlive the message.
  ros1::PointCloudMessage write(const LidarScan& scan, PointTimeZero zero, ScanStamp stamp, Arrangement arrangement,
                                Time clock_origin, std::vector<std::uint8_t>& data) const {
    const CloudLayout times{time_field().name, time_field().datatype, unit, zero, stamp, false, clock_origin};
    const std::vector<std::vector<const LidarPoint*>> rows = rows_of(scan, arrangement);
    ros1::PointCloudMessage message;
    message.stamp = times.stamp_of(scan);
    message.point_step = point_step;
    message.height = static_cast<std::uint32_t>(rows.size());
    message.width = static_cast<std::uint32_t>(rows.front().size());
    message.row_step = message.width * point_step;
    message.dense = arrangement != Arrangement::rings_with_nan;
    for (const VendorField& field : fields) message.fields.push_back({field.name, field.offset, field.datatype, 1});
    data.clear();
    for (const auto& row : rows) {
      for (const LidarPoint* point : row) {
        // Bytes between fields are arbitrary; a no-return has only zeros, also as its time.
        data.resize(data.size() + point_step, point != nullptr ? 0x5A : 0);
        std::uint8_t* at = data.data() + data.size() - point_step;
        if (point != nullptr) {
          const Time zeros_ns[] = {scan.start, message.stamp, 0, clock_origin};
          put_point(at, *point, times, scan.start + point->offset_ns - zeros_ns[static_cast<int>(zero)]);
        } else if (arrangement == Arrangement::rings_with_nan) {
          for (const VendorField& field : fields) {
            if (field.role <= FieldRole::z)
              put_number(at + field.offset, field.datatype, std::numeric_limits<double>::quiet_NaN());
          }
        }
      }
    }
    message.data = data.data();
    message.data_size = data.size();
    return message;
  }

 private:
  const VendorField& time_field() const {
    return *std::find_if(fields.begin(), fields.end(), [](const VendorField& field) {
      return field.role == FieldRole::time || field.role == FieldRole::seconds;
    });
  }

  /// One row of all points, or one row per ring with a no-return after every fifteen points; all rows have the same
  /// length.
  static std::vector<std::vector<const LidarPoint*>> rows_of(const LidarScan& scan, Arrangement arrangement) {
    std::vector<std::vector<const LidarPoint*>> rows(1);
    for (const LidarPoint& point : scan.points) {
      if (arrangement == Arrangement::firing_order) {
        rows.front().push_back(&point);
        continue;
      }
      rows.resize(std::max<std::size_t>(rows.size(), point.ring + 1U));
      std::vector<const LidarPoint*>& row = rows[point.ring];
      if (row.size() % 16 == 0) row.push_back(nullptr);
      row.push_back(&point);
    }
    std::size_t width = 0;
    for (const auto& row : rows) width = std::max(width, row.size());
    for (auto& row : rows) row.resize(width, nullptr);
    return rows;
  }

  void put_point(std::uint8_t* at, const LidarPoint& point, const CloudLayout& times, Time time) const {
    for (const VendorField& field : fields) {
      std::uint8_t* place = at + field.offset;
      switch (field.role) {
        case FieldRole::x:
        case FieldRole::y:
        case FieldRole::z:
          put_number(place, field.datatype, point.position[static_cast<int>(field.role)]);
          break;
        case FieldRole::intensity:
          put_number(place, field.datatype, point.intensity);
          break;
        case FieldRole::ring:
          put_number(place, field.datatype, point.ring);
          break;
        case FieldRole::time:
          times.put_time(place, time);
          break;
        case FieldRole::seconds:
          put_number(place, field.datatype, static_cast<double>(time / 1'000'000'000));
          break;
        case FieldRole::nanoseconds:
          put_number(place, field.datatype, static_cast<double>(time % 1'000'000'000));
          break;
        case FieldRole::other:
          break;
      }
    }
  }

  static void put_number(std::uint8_t* at, std::uint8_t datatype, double value) {
    const auto copy = [at](auto number) { std::memcpy(at, &number, sizeof(number)); };
    switch (datatype) {
      case ros1::PointField::float32:
        return copy(static_cast<float>(value));
      case ros1::PointField::float64:
        return copy(value);
      case ros1::PointField::uint8:
        return copy(static_cast<std::uint8_t>(value));
      case ros1::PointField::uint16:
        return copy(static_cast<std::uint16_t>(value));
      default:
        return copy(static_cast<std::uint32_t>(value));
    }
  }
};

/// Names, types and order of the drivers' fields; packed, or aligned as in PCL.
inline std::vector<VendorCloud> vendor_clouds() {
  using Field = ros1::PointField;
  using Role = FieldRole;
  constexpr auto s = PointTimeUnit::seconds, ms = PointTimeUnit::milliseconds, us = PointTimeUnit::microseconds,
                 ns = PointTimeUnit::nanoseconds;
  constexpr auto since_start = PointTimeZero::scan_start, from_stamp = PointTimeZero::stamp,
                 absolute = PointTimeZero::epoch, own_clock = PointTimeZero::lidar_clock;
  const auto with_xyz = [](std::vector<VendorField> others) {
    std::vector<VendorField> fields{
        {"x", Field::float32, 0, Role::x}, {"y", Field::float32, 4, Role::y}, {"z", Field::float32, 8, Role::z}};
    fields.insert(fields.end(), others.begin(), others.end());
    return fields;
  };
  const auto of_doubles = [](std::uint8_t time_type) {
    return std::vector<VendorField>{{"offset_time", time_type, 0, Role::time}, {"X", Field::float64, 8, Role::x},
                                    {"Y", Field::float64, 16, Role::y},        {"Z", Field::float64, 24, Role::z},
                                    {"channel", Field::uint8, 32, Role::ring}, {"reflectivity", Field::uint8, 33}};
  };
  return {
      // os_cloud_node: 16 bytes of PCL's xyz, then the rest, aligned to 48.
      {"Ouster",
       with_xyz({{"intensity", Field::float32, 16, Role::intensity},
                 {"t", Field::uint32, 20, Role::time},
                 {"reflectivity", Field::uint16, 24},
                 {"ring", Field::uint16, 26, Role::ring},
                 {"ambient", Field::uint16, 28},
                 {"range", Field::uint32, 32}}),
       48,
       ns,
       {since_start}},
      // velodyne_pointcloud: packed; the time is not aligned.
      {"Velodyne",
       with_xyz({{"intensity", Field::float32, 12, Role::intensity},
                 {"ring", Field::uint16, 16, Role::ring},
                 {"time", Field::float32, 18, Role::time}}),
       22,
       s,
       {from_stamp}},
      // HesaiLidar_General_ROS: PCL's alignment.
      {"Hesai",
       with_xyz({{"intensity", Field::float32, 16, Role::intensity},
                 {"timestamp", Field::float64, 24, Role::time},
                 {"ring", Field::uint16, 32, Role::ring}}),
       48,
       s,
       {absolute}},
      {"Hesai, two fields",
       with_xyz({{"intensity", Field::float32, 12, Role::intensity},
                 {"ring", Field::uint16, 16, Role::ring},
                 {"timeSecond", Field::uint32, 18, Role::seconds},
                 {"timeNanosecond", Field::uint32, 22, Role::nanoseconds}}),
       26,
       ns,
       {absolute, own_clock}},
      // rslidar_sdk: packed; absolute, or since the scan's start.
      {"RoboSense",
       with_xyz({{"intensity", Field::float32, 12, Role::intensity},
                 {"ring", Field::uint16, 16, Role::ring},
                 {"timestamp", Field::float64, 18, Role::time}}),
       26,
       s,
       {absolute, since_start}},
      // livox_ros_driver2, xfer_format 0.
      {"Livox",
       with_xyz({{"intensity", Field::float32, 12, Role::intensity},
                 {"tag", Field::uint8, 16},
                 {"line", Field::uint8, 17, Role::ring},
                 {"timestamp", Field::float64, 18, Role::time}}),
       26,
       ns,
       {absolute}},
      // FAST-LIO's republished clouds: PCL's PointXYZINormal.
      {"FAST-LIO",
       with_xyz({{"normal_x", Field::float32, 16},
                 {"normal_y", Field::float32, 20},
                 {"normal_z", Field::float32, 24},
                 {"intensity", Field::float32, 32, Role::intensity},
                 {"curvature", Field::float32, 36, Role::time}}),
       48,
       ms,
       {since_start}},
      {"doubles", of_doubles(Field::uint32), 40, us, {since_start, own_clock}},
      {"doubles, signed times", of_doubles(Field::int32), 34, us, {from_stamp}},
  };
}

}  // namespace lodestone::testing

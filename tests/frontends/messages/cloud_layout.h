#pragma once

#include <cstring>
#include <string>
#include <vector>

#include "core/measurements.h"
#include "frontends/configuration/platform.h"
#include "frontends/messages/point_times.h"
#include "frontends/messages/ros_messages.h"

namespace lodestone::testing {

/// A layout of a scan's times in a driver's cloud.
struct CloudLayout {
  std::string field = "t";
  std::uint8_t datatype = ros1::PointField::uint32;
  PointTimeUnit unit = PointTimeUnit::nanoseconds;
  PointTimeZero zero = PointTimeZero::scan_start;
  ScanStamp stamp = ScanStamp::start;
  bool as_pair = false;   ///< 64 bits as two uint32
  Time clock_origin = 0;  ///< of the LiDAR's own clock

  static constexpr std::uint32_t point_step = 32;

  Time stamp_of(const LidarScan& scan) const {
    if (stamp == ScanStamp::start) return scan.start;
    return stamp == ScanStamp::end ? scan.end : scan.start + (scan.end - scan.start) / 2;
  }

  /// Largest rounding error of a time by its type, ns.
  double quantum_ns(Time largest) const {
    const auto unit_ns = static_cast<double>(nanoseconds_per(unit));
    if (datatype == ros1::PointField::float32) return static_cast<double>(largest) * 6e-8;
    if (datatype == ros1::PointField::float64) return static_cast<double>(largest) * 1.2e-16 + 0.5;
    return 0.5 * unit_ns;
  }

  /// `data` must outlive the message.
  ros1::PointCloudMessage write(const LidarScan& scan, std::vector<std::uint8_t>& data) const {
    using Field = ros1::PointField;
    ros1::PointCloudMessage message;
    message.stamp = stamp_of(scan);
    message.width = static_cast<std::uint32_t>(scan.points.size());
    message.point_step = point_step;
    message.row_step = point_step * message.width;
    message.fields = {{"x", 0, Field::float32, 1},          {"y", 4, Field::float32, 1},    {"z", 8, Field::float32, 1},
                      {"intensity", 12, Field::float32, 1}, {"ring", 16, Field::uint16, 1}, {field, 24, datatype, 1}};
    if (as_pair) message.fields.back() = {field, 24, Field::uint32, 2};
    data.assign(scan.points.size() * point_step, 0);
    for (std::size_t i = 0; i < scan.points.size(); ++i) {
      const LidarPoint& point = scan.points[i];
      std::uint8_t* at = data.data() + i * point_step;
      std::memcpy(at, point.position.data(), 12);
      std::memcpy(at + 12, &point.intensity, 4);
      std::memcpy(at + 16, &point.ring, 2);
      const Time time = scan.start + point.offset_ns;
      const Time zeros[] = {scan.start, message.stamp, 0, clock_origin};
      put_time(at + 24, time - zeros[static_cast<int>(zero)]);
    }
    message.data = data.data();
    message.data_size = data.size();
    return message;
  }

  /// The time in the field's unit and type.
  void put_time(std::uint8_t* at, Time value_ns) const {
    const Time unit_ns = nanoseconds_per(unit);
    const Time rounded = (value_ns + (value_ns < 0 ? -unit_ns / 2 : unit_ns / 2)) / unit_ns;
    const Time whole = value_ns / unit_ns, rest_ns = value_ns % unit_ns;
    const double exact = static_cast<double>(whole) + static_cast<double>(rest_ns) / static_cast<double>(unit_ns);
    const auto copy = [at](auto value) { std::memcpy(at, &value, sizeof(value)); };
    switch (datatype) {
      case ros1::PointField::float32:
        return copy(static_cast<float>(exact));
      case ros1::PointField::float64:
        return copy(exact);
      case ros1::PointField::uint16:
        return copy(static_cast<std::uint16_t>(rounded));
      case ros1::PointField::int32:
        return copy(static_cast<std::int32_t>(rounded));
      case ros1::PointField::uint32:
        return copy(static_cast<std::uint32_t>(rounded));
      default:
        return copy(static_cast<std::uint64_t>(rounded));
    }
  }
};

}  // namespace lodestone::testing

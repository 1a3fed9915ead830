#include "frontends/readers/point_cloud_decoder.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "core/error.h"
#include "frontends/configuration/nearest_name.h"

namespace lodestone {
namespace {

using ros1::PointCloudMessage;
using ros1::PointField;

std::uint32_t size_of(std::uint8_t datatype) {
  switch (datatype) {
    case PointField::int8:
    case PointField::uint8:
      return 1;
    case PointField::int16:
    case PointField::uint16:
      return 2;
    case PointField::int32:
    case PointField::uint32:
    case PointField::float32:
      return 4;
    case PointField::float64:
      return 8;
    default:
      return 0;
  }
}

/// Calls sink(index, value) for each point, value in the column's own type: one loop a type, no branch a point.
template <class Type, class Sink>
void read_column_as(const std::uint8_t* data, std::size_t count, std::size_t step, const Sink& sink) {
  for (std::size_t i = 0; i < count; ++i, data += step) {
    Type value;
    std::memcpy(&value, data, sizeof(value));
    sink(i, value);
  }
}

template <class Sink>
void read_column(std::uint8_t datatype, const std::uint8_t* data, std::size_t count, std::size_t step,
                 const Sink& sink) {
  switch (datatype) {
    case PointField::int8:
      return read_column_as<std::int8_t>(data, count, step, sink);
    case PointField::uint8:
      return read_column_as<std::uint8_t>(data, count, step, sink);
    case PointField::int16:
      return read_column_as<std::int16_t>(data, count, step, sink);
    case PointField::uint16:
      return read_column_as<std::uint16_t>(data, count, step, sink);
    case PointField::int32:
      return read_column_as<std::int32_t>(data, count, step, sink);
    case PointField::uint32:
      return read_column_as<std::uint32_t>(data, count, step, sink);
    case PointField::float32:
      return read_column_as<float>(data, count, step, sink);
    case PointField::float64:
      return read_column_as<double>(data, count, step, sink);
    default:
      return;
  }
}

Time nanoseconds_per_unit(PointTimeUnit unit) {
  switch (unit) {
    case PointTimeUnit::seconds:
      return 1'000'000'000;
    case PointTimeUnit::milliseconds:
      return 1'000'000;
    case PointTimeUnit::microseconds:
      return 1'000;
    case PointTimeUnit::nanoseconds:
      break;
  }
  return 1;
}

bool same_fields(const std::vector<PointField>& a, const std::vector<PointField>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const PointField& left, const PointField& right) {
    return left.offset == right.offset && left.datatype == right.datatype && left.count == right.count &&
           left.name == right.name;
  });
}

/// A per-point time of more than this is no time within a scan but an absolute one.
constexpr Time absolute_time_limit = 1'000'000'000'000;

}  // namespace

PointCloudDecoder::PointCloudDecoder(std::string source, const Platform& platform, WarningLog& warnings)
    : source_(std::move(source)),
      layout_(platform.lidar),
      platform_file_(platform.file.empty() ? "the platform file" : platform.file),
      period_ns_(from_seconds(platform.suite.lidar.scan_period_s)),
      warnings_(warnings) {}

void PointCloudDecoder::decode(const PointCloudMessage& message, LidarScan& scan) {
  if (step_ == 0 || message.point_step != known_step_ || !same_fields(message.fields, known_fields_)) {
    resolve_fields(message);
  }
  const std::size_t count = point_count(message);
  read_points(message, count, scan);
  keep_returns(message, scan);
  place_in_time(message, scan);
}

void PointCloudDecoder::decode(const ros1::LivoxMessage& message, LidarScan& scan) {
  if (livox_cloud_.fields.empty()) {
    livox_cloud_.fields = ros1::LivoxMessage::fields();
    livox_cloud_.point_step = ros1::LivoxMessage::point_step;
    take_livox_fields("reflectivity", "offset_time");
  }
  livox_cloud_.stamp = message.stamp;
  livox_cloud_.width = message.point_count;
  livox_cloud_.data = message.data;
  livox_cloud_.data_size = message.data_size;
  // As the driver's PointCloud2 says them. The stamp, not the timebase: the other sensors have the host's clock too.
  time_origin_ = layout_.stamp == ScanStamp::start ? message.stamp : 0;
  decode(livox_cloud_, scan);
}

void PointCloudDecoder::take_livox_fields(const char* intensity, const char* time) {
  layout_.intensity_field = intensity;
  layout_.ring_field = "line";
  layout_.time_field = time;
  layout_.time_unit = PointTimeUnit::nanoseconds;
  time_keys_ = "lidar.scan_period_s";
}

void PointCloudDecoder::fail(const PointCloudMessage& message, const std::string& what) const {
  throw InputError(fmt::format("{}: {} at {:.9f} s: {}", source_, layout_.topic, to_seconds(message.stamp), what));
}

PointCloudDecoder::Column PointCloudDecoder::find_column(const PointCloudMessage& message, const std::string& name,
                                                         const char* key, bool floating_only) const {
  std::vector<std::string> names;
  for (const PointField& field : message.fields) {
    names.push_back(field.name);
    if (field.name != name) continue;
    const bool floating = field.datatype == PointField::float32 || field.datatype == PointField::float64;
    if (size_of(field.datatype) == 0 || (floating_only && !floating)) {
      fail(message, fmt::format("the point field '{}' has the datatype {}; expected {}", name, int{field.datatype},
                                floating_only ? "FLOAT32 (7) or FLOAT64 (8)" : "one of 1 to 8"));
    }
    return {field.offset, field.datatype};
  }
  const std::string hint = names.empty() ? "" : fmt::format("; the nearest is '{}'", nearest_name(name, names));
  fail(message, fmt::format("there is no point field '{}'; the message has {}{}; set lidar.fields.{} in {}", name,
                            names.empty() ? "none" : join_names(names), hint, key, platform_file_));
}

void PointCloudDecoder::resolve_fields(const PointCloudMessage& message) {
  if (message.big_endian) fail(message, "the cloud is big-endian; expected little-endian data");
  if (layout_.time_field.empty()) {
    const auto has = [&message](const char* name, std::uint8_t datatype) {
      return std::any_of(message.fields.begin(), message.fields.end(), [&](const PointField& field) {
        return field.name == name && field.datatype == datatype;
      });
    };
    const bool is_livox = has("tag", PointField::uint8) && has("line", PointField::uint8) &&
                          has("timestamp", PointField::float64);
    if (!is_livox) {
      std::vector<std::string> names;
      for (const PointField& field : message.fields) names.push_back(field.name);
      fail(message, fmt::format("{} names no point field with each point's own time; the message has {}; set "
                                "lidar.fields.time and lidar.time_unit (only Livox' messages need neither)",
                                platform_file_, names.empty() ? "none" : join_names(names)));
    }
    take_livox_fields("intensity", "timestamp");
  }
  x_ = find_column(message, "x", "x", true);
  y_ = find_column(message, "y", "y", true);
  z_ = find_column(message, "z", "z", true);
  time_ = find_column(message, layout_.time_field, "time (each point's own time, for undistortion)", false);
  intensity_ = layout_.intensity_field.empty() ? Column{}
                                               : find_column(message, layout_.intensity_field, "intensity", false);
  ring_ = layout_.ring_field.empty() ? Column{} : find_column(message, layout_.ring_field, "ring", false);
  known_fields_ = message.fields;
  known_step_ = step_ = message.point_step;
  for (const PointField& field : message.fields) {
    if (field.offset + size_of(field.datatype) * std::max(field.count, 1U) > step_) {
      fail(message, fmt::format("the point field '{}' ends beyond the point's {} bytes", field.name, step_));
    }
  }
  // Some recorders announce an aligned layout and write a packed one: the data's size tells.
  std::uint32_t packed = 0;
  for (const PointField& field : message.fields) packed += size_of(field.datatype) * std::max(field.count, 1U);
  const std::size_t count = std::size_t{message.width} * message.height;
  if (count == 0 || packed == step_ || message.data_size != count * packed) return;
  warnings_.add("lidar.packed_points",
                fmt::format("{}: points take {} bytes, not the {} of point_step; read without gaps between fields",
                            layout_.topic, packed, step_),
                message.stamp);
  const auto pack = [&message](Column& column) {
    std::uint32_t offset = 0;
    for (const PointField& field : message.fields) {
      if (column.datatype != 0 && column.offset == field.offset) {
        column.offset = offset;
        return;
      }
      offset += size_of(field.datatype) * std::max(field.count, 1U);
    }
  };
  for (Column* column : {&x_, &y_, &z_, &intensity_, &ring_, &time_}) pack(*column);
  step_ = packed;
}

std::size_t PointCloudDecoder::point_count(const PointCloudMessage& message) {
  const std::size_t count = std::size_t{message.width} * message.height;
  if (message.data_size < count * step_) {
    fail(message, fmt::format("the cloud has {} bytes of data; expected {} ({} x {} points of {} bytes)",
                              message.data_size, count * step_, message.width, message.height, step_));
  }
  return count;
}

void PointCloudDecoder::read_points(const PointCloudMessage& message, std::size_t count, LidarScan& scan) {
  scan.points.resize(count);
  times_.resize(count);
  const auto read = [&](const Column& column, const auto& sink) {
    read_column(column.datatype, message.data + column.offset, count, step_, sink);
  };
  LidarPoint* points = scan.points.data();
  read(x_, [points](std::size_t i, auto value) { points[i].position.x() = static_cast<float>(value); });
  read(y_, [points](std::size_t i, auto value) { points[i].position.y() = static_cast<float>(value); });
  read(z_, [points](std::size_t i, auto value) { points[i].position.z() = static_cast<float>(value); });
  read(intensity_, [points](std::size_t i, auto value) { points[i].intensity = static_cast<float>(value); });
  read(ring_, [points](std::size_t i, auto value) { points[i].ring = static_cast<std::uint16_t>(value); });
  const Time unit = nanoseconds_per_unit(layout_.time_unit), origin = time_origin_;
  Time* times = times_.data();
  read(time_, [times, unit, origin](std::size_t i, auto value) {
    if constexpr (std::is_floating_point_v<decltype(value)>) {
      const double nanoseconds = static_cast<double>(value) * static_cast<double>(unit);
      times[i] = std::abs(nanoseconds) < 9.2e18 ? std::llround(nanoseconds) : std::numeric_limits<Time>::max();
    } else {
      times[i] = static_cast<Time>(value) * unit + origin;
    }
  });
}

void PointCloudDecoder::keep_returns(const PointCloudMessage& message, LidarScan& scan) {
  std::size_t kept = 0;
  std::int64_t not_finite = 0;
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    const Eigen::Vector3f& position = scan.points[i].position;
    if (!position.allFinite()) {
      ++not_finite;
      continue;
    }
    if (position.isZero(0.0F)) continue;
    scan.points[kept] = scan.points[i];
    times_[kept] = times_[i];
    ++kept;
  }
  scan.points.resize(kept);
  times_.resize(kept);
  if (not_finite > 0) {
    warnings_.add("lidar.nan_points", fmt::format("{}: points without a finite position were dropped", layout_.topic),
                  message.stamp, not_finite);
  }
}

void PointCloudDecoder::place_in_time(const PointCloudMessage& message, LidarScan& scan) {
  if (scan.points.empty()) {
    warnings_.add("lidar.empty_scan", fmt::format("{}: a scan has no points", layout_.topic), message.stamp);
    scan.start = layout_.stamp == ScanStamp::start ? message.stamp : message.stamp - period_ns_;
    scan.end = scan.start + period_ns_;
    return;
  }
  const auto [first, last] = std::minmax_element(times_.begin(), times_.end());
  const Time earliest = *first;
  const Time latest = *last;
  const double span_s = static_cast<double>(latest) * 1e-9 - static_cast<double>(earliest) * 1e-9;
  const double period_s = to_seconds(period_ns_);
  // A wrong unit is wrong by a thousand at least; a sparse scan is shorter than the period, but not so much.
  constexpr std::size_t enough_points = 1000;
  if (span_s > 5.0 * period_s || (scan.points.size() >= enough_points && span_s < 0.01 * period_s)) {
    fail(message, fmt::format("the points' times ('{}') span {:.3g} s; expected about the scan's period of {:g} s; set "
                              "{} in {}",
                              layout_.time_field, span_s, period_s, time_keys_, platform_file_));
  }
  Time zero = earliest;  // the value of the time field that gets offset 0
  if (earliest > absolute_time_limit || time_origin_ != 0) {
    scan.start = earliest;
  } else if (layout_.stamp == ScanStamp::end) {
    scan.start = message.stamp - (latest - earliest);
  } else {
    zero = std::min(earliest, Time{0});
    scan.start = message.stamp + zero;
  }
  scan.end = scan.start + (latest - zero);
  if (latest - zero > 5 * period_ns_ || latest - zero > std::numeric_limits<std::int32_t>::max()) {
    fail(message, fmt::format("the latest point lies {:.3g} s after the stamp; expected about the scan's period of {:g} "
                              "s; set {} in {}",
                              to_seconds(latest - zero), period_s, time_keys_, platform_file_));
  }
  for (std::size_t i = 0; i < times_.size(); ++i) {
    scan.points[i].offset_ns = static_cast<std::int32_t>(times_[i] - zero);
  }
}

}  // namespace lodestone

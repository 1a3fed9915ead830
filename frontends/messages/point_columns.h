#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include "frontends/messages/ros_messages.h"

/// Columns of a PointCloud2: one field of all points, read in its own type.
namespace lodestone {

struct PointColumn {
  std::uint32_t offset = 0;   ///< bytes from a point's begin
  std::uint8_t datatype = 0;  ///< ros1::PointField's; 0: absent
  std::string name{};
  /// For a time in two fields: the field of nanoseconds; the field above has the seconds. Datatype 0: a single field.
  std::uint32_t nanoseconds_offset = 0;
  std::uint8_t nanoseconds_datatype = 0;
};

/// Bytes of one number; 0 for an unknown type.
inline std::uint32_t size_of_datatype(std::uint8_t datatype) {
  using Field = ros1::PointField;
  switch (datatype) {
    case Field::int8:
    case Field::uint8:
      return 1;
    case Field::int16:
    case Field::uint16:
      return 2;
    case Field::int32:
    case Field::uint32:
    case Field::float32:
      return 4;
    case Field::int64:
    case Field::uint64:
    case Field::float64:
      return 8;
    default:
      return 0;
  }
}

inline const char* name_of_datatype(std::uint8_t datatype) {
  constexpr const char* names[] = {"absent", "int8",    "uint8",   "int16", "uint16", "int32",
                                   "uint32", "float32", "float64", "int64", "uint64"};
  return datatype < std::size(names) ? names[datatype] : "of an unknown type";
}

/// Bytes of a field; large counts do not overflow.
inline std::uint64_t size_of_field(const ros1::PointField& field) {
  return std::uint64_t{size_of_datatype(field.datatype)} * (field.count == 0 ? 1 : field.count);
}

/// Calls sink(index, value) for each point, with the value in the column's type: one loop per type, without branches.
template <class Type, class Sink>
void read_column_as(const std::uint8_t* data, std::size_t count, std::size_t step, const Sink& sink) {
  for (std::size_t i = 0; i < count; ++i, data += step) {
    Type value;
    std::memcpy(&value, data, sizeof(value));
    sink(i, value);
  }
}

/// Reads one field of all points; see read_column.
template <class Sink>
void read_single_column(const PointColumn& column, const std::uint8_t* data, std::size_t count, std::size_t step,
                        const Sink& sink) {
  using Field = ros1::PointField;
  data += column.offset;
  switch (column.datatype) {
    case Field::int8:
      return read_column_as<std::int8_t>(data, count, step, sink);
    case Field::uint8:
      return read_column_as<std::uint8_t>(data, count, step, sink);
    case Field::int16:
      return read_column_as<std::int16_t>(data, count, step, sink);
    case Field::uint16:
      return read_column_as<std::uint16_t>(data, count, step, sink);
    case Field::int32:
      return read_column_as<std::int32_t>(data, count, step, sink);
    case Field::uint32:
      return read_column_as<std::uint32_t>(data, count, step, sink);
    case Field::int64:
      return read_column_as<std::int64_t>(data, count, step, sink);
    case Field::uint64:
      return read_column_as<std::uint64_t>(data, count, step, sink);
    case Field::float32:
      return read_column_as<float>(data, count, step, sink);
    case Field::float64:
      return read_column_as<double>(data, count, step, sink);
    default:
      return;
  }
}

template <class Sink>
void read_paired_column(const PointColumn& column, const std::uint8_t* data, std::size_t count, std::size_t step,
                        const Sink& sink) {
  // Limits for arbitrary bytes: the sum fits 64 bits, 9e18 + 2e17.
  const auto within = [](auto value, std::int64_t most) {
    const auto number = static_cast<double>(value);
    if (!(number > -static_cast<double>(most))) return -most;
    return number < static_cast<double>(most) ? static_cast<std::int64_t>(value) : most;
  };
  std::vector<std::int64_t> times(count);
  read_single_column({column.offset, column.datatype}, data, count, step,
                     [&](std::size_t i, auto seconds) { times[i] = within(seconds, 9'000'000'000) * 1'000'000'000; });
  read_single_column(
      {column.nanoseconds_offset, column.nanoseconds_datatype}, data, count, step,
      [&](std::size_t i, auto nanoseconds) { sink(i, times[i] + within(nanoseconds, 200'000'000'000'000'000)); });
}

/// `data`: the first point, or null. An absent column causes no calls. A column of seconds and nanoseconds gives their
/// sum, std::int64_t ns.
template <class Sink>
void read_column(const PointColumn& column, const std::uint8_t* data, std::size_t count, std::size_t step,
                 const Sink& sink) {
  if (count == 0) return;
  if (column.nanoseconds_datatype != 0) return read_paired_column(column, data, count, step, sink);
  read_single_column(column, data, count, step, sink);
}

}  // namespace lodestone

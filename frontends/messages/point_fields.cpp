#include "frontends/messages/point_fields.h"

#include <fmt/format.h>

#include <algorithm>
#include <initializer_list>
#include <map>

#include "core/error.h"
#include "core/nearest_name.h"
#include "frontends/messages/point_times.h"

namespace lodestone {
namespace {

using ros1::PointCloudMessage;
using ros1::PointField;

std::string names_of(const PointCloudMessage& message) {
  return message.fields.empty() ? "none" : join_names(message.fields, &PointField::name);
}

/// The first of `names` that is a field; empty if none is.
std::string first_present(const PointCloudMessage& message, std::initializer_list<const char*> names) {
  for (const char* name : names) {
    for (const PointField& field : message.fields) {
      if (field.name == name && size_of_datatype(field.datatype) != 0) return name;
    }
  }
  return {};
}

/// Two uint32 contain one 64-bit integer, because sensor_msgs has no such type.
PointColumn time_column_of(const PointField& field) {
  const bool pair = field.datatype == PointField::uint32 && field.count == 2;
  return {field.offset, pair ? std::uint8_t{PointField::uint64} : field.datatype, field.name};
}

/// Integers of four bytes or more: two bytes are too small for the nanoseconds of a second.
bool is_integer(const PointField& field) {
  return size_of_datatype(field.datatype) >= 4 && field.datatype != PointField::float32 &&
         field.datatype != PointField::float64;
}

/// Times in two fields, seconds and nanoseconds: integers with names that differ only in the unit. With `one_of`, only
/// the pair of that field.
std::vector<PointColumn> paired_times(const PointCloudMessage& message, const std::string& one_of = {}) {
  std::map<std::string, const PointField*> nanoseconds;
  for (const PointField& field : message.fields) {
    const auto part = time_part_of(field.name);
    if (part && part->nanoseconds && is_integer(field)) nanoseconds.emplace(part->stem, &field);
  }
  std::vector<PointColumn> found;
  for (const PointField& field : message.fields) {
    const auto part = time_part_of(field.name);
    if (!part || part->nanoseconds || !is_integer(field)) continue;
    const auto other = nanoseconds.find(part->stem);
    if (other == nanoseconds.end()) continue;
    const PointField& fine = *other->second;
    if (!one_of.empty() && field.name != one_of && fine.name != one_of) continue;
    found.push_back({field.offset, field.datatype, field.name + " + " + fine.name, fine.offset, fine.datatype});
  }
  return found;
}

/// Finds the columns of one message, or reports what is wrong.
struct FieldFinder {
  const PointCloudMessage& message;
  const PointFieldsContext& context;

  [[noreturn]] void fail(const std::string& what) const { throw InputError(context.where + ": " + what); }

  PointColumn column_of(const PointField& field, bool floating_only) const {
    const bool floating = field.datatype == PointField::float32 || field.datatype == PointField::float64;
    if (size_of_datatype(field.datatype) == 0 || (floating_only && !floating)) {
      fail(fmt::format("the point field '{}' has the datatype {}; expected {}", field.name, int{field.datatype},
                       floating_only ? "FLOAT32 (7) or FLOAT64 (8)" : "one of 1 to 10"));
    }
    return time_column_of(field);
  }

  /// `axis`: x, y or z. Some recorders write X, Y, Z.
  PointColumn coordinate(char axis) const {
    for (const char letter : {axis, static_cast<char>(axis - 'x' + 'X')}) {
      for (const PointField& field : message.fields) {
        if (field.name == std::string(1, letter)) return column_of(field, true);
      }
    }
    fail(
        fmt::format("there is no point field '{}'; the message has {}; record or convert the cloud with its "
                    "coordinates in metres as "
                    "the fields x, y and z (FLOAT32 or FLOAT64); other names are not supported",
                    axis, names_of(message)));
  }

  /// `otherwise`: a further remedy for the message.
  PointColumn column(const std::string& name, const char* key, const std::string& otherwise = {}) const {
    std::vector<std::string> names;
    for (const PointField& field : message.fields) {
      if (field.name == name) return column_of(field, false);
      names.push_back(field.name);
    }
    const std::string hint = names.empty() ? "" : fmt::format("; the nearest is '{}'", nearest_name(name, names));
    fail(fmt::format("there is no point field '{}'; the message has {}{}; set {}.fields.{} in {}{}", name,
                     names_of(message), hint, context.keys, key, context.platform_file, otherwise));
  }

  bool has_times() const {
    return std::any_of(message.fields.begin(), message.fields.end(),
                       [](const PointField& field) { return time_name_rank(field.name) || time_part_of(field.name); });
  }

  std::vector<PointColumn> times(const LidarMessageLayout& layout) const {
    if (layout.point_times == PointTimes::none) return {};
    const std::string deskewed = ", or " + context.keys + ".point_times: none if the scans are deskewed already";
    if (!layout.time_field.empty()) {
      std::vector<PointColumn> paired = paired_times(message, layout.time_field);
      if (!paired.empty()) return {paired.front()};
      return {column(layout.time_field, "time (each point's time, for deskewing)", has_times() ? "" : deskewed)};
    }
    std::vector<PointColumn> found;
    for (const PointField& field : message.fields) {
      if (time_name_rank(field.name) && size_of_datatype(field.datatype) != 0) found.push_back(time_column_of(field));
    }
    std::stable_sort(found.begin(), found.end(), [](const PointColumn& a, const PointColumn& b) {
      return *time_name_rank(a.name) < *time_name_rank(b.name);
    });
    // A field of nanoseconds alone restarts each second. Therefore pairs with seconds come first.
    std::vector<PointColumn> paired = paired_times(message);
    found.insert(found.begin(), paired.begin(), paired.end());
    if (!found.empty()) return found;
    fail(fmt::format(
        "{} names no point field with each point's time, and no field has the name of a time; the message has {}; "
        "set {}.fields.time, or record the driver's full points{}",
        context.platform_file, names_of(message), context.keys, deskewed));
  }

  /// Some recorders announce an aligned layout, but write a packed one. The size of the data decides.
  void unpack(PointFields& fields) const {
    std::uint64_t packed = 0;
    for (const PointField& field : message.fields) {
      packed += size_of_field(field);
      if (field.offset + size_of_field(field) > fields.step) {
        fail(fmt::format("the point field '{}' ends beyond the point's {} bytes", field.name, fields.step));
      }
    }
    const std::size_t count = std::size_t{message.width} * message.height;
    if (count == 0 || packed == fields.step || message.data_size != count * packed) return;
    const auto pack = [this](std::uint32_t& place) {
      std::uint64_t offset = 0;
      for (const PointField& field : message.fields) {
        if (place == field.offset) {
          place = static_cast<std::uint32_t>(offset);
          return;
        }
        offset += size_of_field(field);
      }
    };
    for (PointColumn* column : {&fields.x, &fields.y, &fields.z, &fields.intensity, &fields.ring}) {
      if (column->datatype != 0) pack(column->offset);
    }
    for (PointColumn& column : fields.times) {
      pack(column.offset);
      if (column.nanoseconds_datatype != 0) pack(column.nanoseconds_offset);
    }
    fields.step = static_cast<std::uint32_t>(packed);
    fields.packed = true;
  }
};

}  // namespace

PointFields find_point_fields(const PointCloudMessage& message, const LidarMessageLayout& layout,
                              const PointFieldsContext& context) {
  const FieldFinder finder{message, context};
  if (message.big_endian) finder.fail("the cloud is big-endian; expected little-endian data");
  PointFields fields;
  fields.x = finder.coordinate('x');
  fields.y = finder.coordinate('y');
  fields.z = finder.coordinate('z');
  fields.times = finder.times(layout);
  const bool by_name = layout.time_field.empty() || layout.point_times == PointTimes::none;
  std::string intensity = layout.intensity_field, ring = layout.ring_field;
  if (by_name && intensity.empty()) intensity = first_present(message, {"intensity", "reflectivity", "i"});
  if (by_name && ring.empty()) ring = first_present(message, {"ring", "line", "channel", "laser_id", "row"});
  if (!intensity.empty()) fields.intensity = finder.column(intensity, "intensity");
  if (!ring.empty()) fields.ring = finder.column(ring, "ring");
  fields.step = message.point_step;
  finder.unpack(fields);
  return fields;
}

}  // namespace lodestone

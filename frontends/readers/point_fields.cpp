#include "frontends/readers/point_fields.h"

#include <fmt/format.h>

#include <algorithm>
#include <initializer_list>

#include "core/error.h"
#include "frontends/configuration/nearest_name.h"
#include "frontends/readers/point_times.h"

namespace lodestone {
namespace {

using ros1::PointCloudMessage;
using ros1::PointField;

std::string names_of(const PointCloudMessage& message) {
  std::vector<std::string> names;
  for (const PointField& field : message.fields) names.push_back(field.name);
  return names.empty() ? "none" : join_names(names);
}

/// The first of `names` that is a field; empty where none is.
std::string first_there(const PointCloudMessage& message, std::initializer_list<const char*> names) {
  for (const char* name : names) {
    for (const PointField& field : message.fields) {
      if (field.name == name && size_of_datatype(field.datatype) != 0) return name;
    }
  }
  return {};
}

/// Two uint32 hold one integer of 64 bits, for sensor_msgs has no type for it.
PointColumn time_column_of(const PointField& field) {
  const bool pair = field.datatype == PointField::uint32 && field.count == 2;
  return {field.offset, pair ? std::uint8_t{PointField::uint64} : field.datatype, field.name};
}

/// Finds the columns of one message, or says what is wrong with it.
struct FieldFinder {
  const PointCloudMessage& message;
  const PointFieldsContext& context;

  [[noreturn]] void fail(const std::string& what) const { throw InputError(context.where + ": " + what); }

  PointColumn column(const std::string& name, const char* key, bool floating_only) const {
    for (const PointField& field : message.fields) {
      if (field.name != name) continue;
      const bool floating = field.datatype == PointField::float32 || field.datatype == PointField::float64;
      if (size_of_datatype(field.datatype) == 0 || (floating_only && !floating)) {
        fail(fmt::format("the point field '{}' has the datatype {}; expected {}", name, int{field.datatype},
                         floating_only ? "FLOAT32 (7) or FLOAT64 (8)" : "one of 1 to 10"));
      }
      return time_column_of(field);
    }
    std::vector<std::string> names;
    for (const PointField& field : message.fields) names.push_back(field.name);
    const std::string hint = names.empty() ? "" : fmt::format("; the nearest is '{}'", nearest_name(name, names));
    fail(fmt::format("there is no point field '{}'; the message has {}{}; set {}.fields.{} in {}", name, names_of(message),
                     hint, context.keys, key, context.platform_file));
  }

  std::vector<PointColumn> times(const LidarMessageLayout& layout) const {
    if (!layout.time_field.empty()) {
      return {column(layout.time_field, "time (each point's own time, for undistortion)", false)};
    }
    std::vector<PointColumn> found;
    for (const PointField& field : message.fields) {
      if (time_name_rank(field.name) && size_of_datatype(field.datatype) != 0) found.push_back(time_column_of(field));
    }
    std::stable_sort(found.begin(), found.end(), [](const PointColumn& a, const PointColumn& b) {
      return *time_name_rank(a.name) < *time_name_rank(b.name);
    });
    if (!found.empty()) return found;
    fail(fmt::format("{} names no point field with each point's own time, and none is called like one; the message has {}; "
                     "set {}.fields.time, or record the driver's full points",
                     context.platform_file, names_of(message), context.keys));
  }

  /// Some recorders announce an aligned layout and write a packed one: the data's size tells.
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
    const auto pack = [this](PointColumn& column) {
      std::uint64_t offset = 0;
      for (const PointField& field : message.fields) {
        if (column.datatype != 0 && column.offset == field.offset) {
          column.offset = static_cast<std::uint32_t>(offset);
          return;
        }
        offset += size_of_field(field);
      }
    };
    for (PointColumn* column : {&fields.x, &fields.y, &fields.z, &fields.intensity, &fields.ring}) pack(*column);
    for (PointColumn& column : fields.times) pack(column);
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
  fields.x = finder.column("x", "x", true);
  fields.y = finder.column("y", "y", true);
  fields.z = finder.column("z", "z", true);
  fields.times = finder.times(layout);
  const bool by_name = layout.time_field.empty();
  std::string intensity = layout.intensity_field, ring = layout.ring_field;
  if (by_name && intensity.empty()) intensity = first_there(message, {"intensity", "reflectivity", "i"});
  if (by_name && ring.empty()) ring = first_there(message, {"ring", "line", "channel", "laser_id", "row"});
  if (!intensity.empty()) fields.intensity = finder.column(intensity, "intensity", false);
  if (!ring.empty()) fields.ring = finder.column(ring, "ring", false);
  fields.step = message.point_step;
  finder.unpack(fields);
  return fields;
}

}  // namespace lodestone

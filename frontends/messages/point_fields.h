#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "frontends/configuration/platform.h"
#include "frontends/logs/ros1/messages.h"
#include "frontends/messages/point_columns.h"

namespace lodestone {

/// Where a cloud's fields lie.
struct PointFields {
  PointColumn x, y, z;
  PointColumn intensity, ring;     ///< absent where the message has none
  std::vector<PointColumn> times;  ///< none with point_times: none, else at least one; several only where the layout
                                   ///< names none: the likeliest by its name first
  std::uint32_t step = 0;          ///< bytes from one point to the next
  bool packed = false;             ///< the points lie closer than the message says, without gaps between their fields
};

/// For messages.
struct PointFieldsContext {
  std::string where;  ///< log, topic and time
  std::string keys;   ///< where the platform file describes the LiDAR: "lidar"
  std::string platform_file;
};

/// Finds the fields that `layout` names; without a time field, intensity and ring are found by their usual names, and
/// every field that is called like a time is listed. Throws InputError where a field is missing (with those that are
/// there), of a type that cannot be, or reaches beyond the point, and where the cloud is big-endian.
PointFields find_point_fields(const ros1::PointCloudMessage& message, const LidarMessageLayout& layout,
                              const PointFieldsContext& context);

}  // namespace lodestone

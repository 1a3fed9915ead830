#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "frontends/configuration/platform.h"
#include "frontends/messages/point_columns.h"
#include "frontends/messages/ros_messages.h"

namespace lodestone {

/// The columns of a cloud.
struct PointFields {
  PointColumn x, y, z;
  PointColumn intensity, ring;     ///< absent if the message has none
  std::vector<PointColumn> times;  ///< empty with point_times: none, otherwise at least one; several only if the
                                   ///< layout names none: in descending order of likelihood by name
  std::uint32_t step = 0;          ///< bytes from one point to the next
  bool packed = false;             ///< points are packed without gaps, contrary to the announced layout
};

/// Names for messages.
struct PointFieldsContext {
  std::string where;  ///< log, topic and time
  std::string keys;   ///< key of the LiDAR in the platform file: "lidar"
  std::string platform_file;
};

/// Finds the fields that `layout` names. Without a time field in `layout`, intensity and ring are found by their usual
/// names, and all fields with the name of a time are listed. Throws InputError if a field is missing (with the
/// available fields), has an invalid type or exceeds the point, and if the cloud is big-endian.
PointFields find_point_fields(const ros1::PointCloudMessage& message, const LidarMessageLayout& layout,
                              const PointFieldsContext& context);

}  // namespace lodestone

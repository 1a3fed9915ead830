#pragma once

#include <cstdint>
#include <vector>

#include "frontends/messages/ros_messages.h"

namespace lodestone::ros1 {

constexpr Time bag_start = 1'700'000'000'123'456'789;

/// A cloud of x and t. `bytes` must outlive it.
inline PointCloudMessage cloud_of(const std::vector<std::uint8_t>& bytes) {
  PointCloudMessage cloud;
  cloud.frame = "lidar";
  cloud.fields = {{"x", 0, PointField::float32, 1}, {"t", 4, PointField::uint32, 1}};
  cloud.point_step = 8;
  cloud.width = static_cast<std::uint32_t>(bytes.size() / 8);
  cloud.row_step = static_cast<std::uint32_t>(bytes.size());
  cloud.data = bytes.data();
  cloud.data_size = bytes.size();
  return cloud;
}

}  // namespace lodestone::ros1

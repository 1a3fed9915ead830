#pragma once

#include <string>

#include "frontends/configuration/platform.h"

/// A platform's LiDARs by index: 0 is the first, followed by the further ones.
namespace lodestone {

inline std::size_t lidar_count(const Platform& platform) {
  return 1 + platform.further_lidars.size();
}

inline const LidarMessageLayout& layout_of(const Platform& platform, std::size_t lidar) {
  return lidar == 0 ? platform.lidar : platform.further_lidars.at(lidar - 1);
}
inline LidarMessageLayout& layout_of(Platform& platform, std::size_t lidar) {
  return lidar == 0 ? platform.lidar : platform.further_lidars.at(lidar - 1);
}

inline const LidarModel& model_of(const Platform& platform, std::size_t lidar) {
  return lidar == 0 ? platform.suite.lidar : platform.suite.further_lidars.at(lidar - 1);
}

/// Key of the LiDAR in the platform file.
inline std::string lidar_key(std::size_t lidar) {
  return lidar == 0 ? "lidar" : "further_lidars[" + std::to_string(lidar - 1) + "]";
}

}  // namespace lodestone

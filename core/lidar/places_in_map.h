#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "core/geometry/pose.h"

namespace lodestone {

/// Points of the imu frame in the map frame. Positions are added in doubles: far from the map's origin, floats would
/// lose millimetres.
inline std::vector<Eigen::Vector3f> places_in_map(std::span<const Eigen::Vector3f> points, const Pose& T_map_imu) {
  const Eigen::Matrix3f rotation = T_map_imu.rotation.toRotationMatrix().cast<float>();
  std::vector<Eigen::Vector3f> places(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3f turned = rotation * points[i];
    places[i] = (turned.cast<double>() + T_map_imu.position).cast<float>();
  }
  return places;
}

}  // namespace lodestone

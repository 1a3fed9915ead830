#pragma once

#include "core/measurements.h"

namespace lodestone::simulation {

/// Whether all values of two measurements of IMU, magnetometer or LiDAR have the same bits.
inline bool same_measurement(const Measurement& a, const Measurement& b) {
  if (a.index() != b.index()) return false;
  if (const auto* x = std::get_if<ImuSample>(&a)) {
    const auto& y = std::get<ImuSample>(b);
    return x->time == y.time && x->angular_velocity == y.angular_velocity &&
           x->linear_acceleration == y.linear_acceleration;
  }
  if (const auto* x = std::get_if<MagneticSample>(&a)) {
    const auto& y = std::get<MagneticSample>(b);
    return x->time == y.time && x->magnetometer == y.magnetometer && x->field_ut == y.field_ut;
  }
  const auto &x = std::get<LidarScan>(a), &y = std::get<LidarScan>(b);
  bool equal = x.start == y.start && x.end == y.end && x.points.size() == y.points.size();
  for (std::size_t i = 0; equal && i < x.points.size(); ++i) {
    equal = x.points[i].position == y.points[i].position && x.points[i].offset_ns == y.points[i].offset_ns &&
            x.points[i].ring == y.points[i].ring;
  }
  return equal;
}

}  // namespace lodestone::simulation

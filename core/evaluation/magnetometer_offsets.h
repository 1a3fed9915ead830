#pragma once

#include <functional>
#include <vector>

#include "core/evaluation/field_comparison.h"

namespace lodestone {

/// A constant error of one magnetometer over the whole log.
struct MagnetometerOffset {
  Vector3 offset_ut = Vector3::Zero();  ///< magnetometer axes, to be subtracted from its readings; 0: not significant
  double sigma_ut = 0.0;                ///< of the offset, per component
  double spread_ut = 0.0;               ///< robust sigma of the differences about the offset, per component
  std::size_t cells = 0;                ///< cells with readings
  bool odd = false;                     ///< far larger spread than the other magnetometers: stuck, drifting or broken
};

/// The offset of each magnetometer: the median of its differences, in its own axes, over readings in motion where
/// `holds` is true (for instance where the map is not stale). An offset rotates with the sensor; a change of the field
/// does not. If the robot never turns, the two are not observable separately. An offset is zero unless it is
/// significant at a false-alarm probability of 10⁻³. `cell_m`: differences closer than this are correlated.
std::vector<MagnetometerOffset> magnetometer_offsets(const FieldComparison& comparison, double cell_m,
                                                     const std::function<bool(const Vector3&)>& holds);

}  // namespace lodestone

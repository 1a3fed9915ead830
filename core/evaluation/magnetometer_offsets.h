#pragma once

#include <functional>
#include <vector>

#include "core/evaluation/field_comparison.h"

namespace lodestone {

/// What one magnetometer reads beside the field, the whole drive long.
struct MagnetometerOffset {
  Vector3 offset_ut = Vector3::Zero();  ///< in its own axes, to be taken off its readings; zero where not significant
  double sigma_ut = 0.0;                ///< of the offset, a component
  double spread_ut = 0.0;               ///< robust sigma of its differences about the offset, a component
  std::size_t cells = 0;                ///< in which it read something
  bool odd = false;                     ///< they scatter far more than those of its fellows: stuck, drifting, broken
};

/// The offset of each magnetometer: the median of its differences, in its own axes, over what it read on the move where
/// `holds` is true (for instance where the map is not known to be stale). A change of the field has the map's axes and
/// a place, an offset the magnetometer's axes and no place; on a drive without a turn a field that is wrong by the same
/// vector everywhere cannot be told from an offset. It is kept where it exceeds its own sigma with a probability of
/// false alarm of 10⁻³. `cell_m`: differences closer than this are not independent.
std::vector<MagnetometerOffset> magnetometer_offsets(const FieldComparison& comparison, double cell_m,
                                                     const std::function<bool(const Vector3&)>& holds);

}  // namespace lodestone

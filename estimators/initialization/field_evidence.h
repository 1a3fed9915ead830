#pragma once

#include "core/magnetometer/array_reading.h"
#include "core/magnetometer/magnetic_map.h"

namespace lodestone {

/// What the field of a site is like where nobody knows the place: mean and spread over its map.
struct FieldBackground {
  Vector3 mean_ut = Vector3::Zero();  ///< map axes
  double sigma_ut = 1.0;              ///< a component
};

/// Reads the whole map once.
FieldBackground field_background(const MagneticMap& map);

// Priors of the search (docs/design/024-initial-pose-search.md), fixed before the places of its figures were drawn.
inline constexpr double kFieldTrust = 0.5;   ///< power of the field's likelihood: its errors are correlated
inline constexpr double kStaleShare = 0.05;  ///< of the magnetic map, that may have changed since the survey

/// What an array's readings say of a pose.
struct FieldEvidence {
  double log_likelihood = 0.0;   ///< ln p(readings | pose), to the power kFieldTrust
  int on_map = 0;                ///< readings that met the map
  double residual_rms_ut = 0.0;  ///< of these
};

/// The likelihood of one array's readings at `T_map_imu` (the pose at the reading's T_end_mag reference): jointly
/// normal, errors of the map correlated over 0.3 m across the array, and grown by the field's gradient times 3 cm. A
/// reading off the map is one of the background, so that poses on and off the map compare. With probability kStaleShare
/// the map has changed here and all readings are of the background: what a stale map can say against the right place is
/// bounded.
FieldEvidence field_evidence(const ArrayReading& array, const Pose& T_map_imu, const SensorSuite& suite,
                             const MagneticMap& map, const FieldBackground& background);

}  // namespace lodestone

#pragma once

#include "core/magnetometer/array_reading.h"
#include "core/magnetometer/magnetic_map.h"
#include "estimators/initialization/place_search_options.h"

namespace lodestone {

/// What the field of a site is like where nobody knows the place: mean and spread over its map.
struct FieldBackground {
  Vector3 mean_ut = Vector3::Zero();  ///< map axes
  double sigma_ut = 1.0;              ///< a component
};

/// Reads the whole map once.
FieldBackground field_background(const MagneticMap& map);

/// What an array's readings say of a pose.
struct FieldEvidence {
  double log_likelihood = 0.0;   ///< ln p(readings | pose), to the power options.field_trust
  int on_map = 0;                ///< readings that met the map
  double residual_rms_ut = 0.0;  ///< of these
};

/// The likelihood of one array's readings at `T_map_imu` (the pose at the reading's T_end_mag reference): jointly
/// normal, errors of the map correlated over options.field_correlation_m across the array, and grown by the field's
/// gradient times options.position_sigma_m. A reading off the map is one of the background, so that poses on and off
/// the map compare. With probability options.stale_share the map has changed here and all readings are of the
/// background: what a stale map can say against the right place is bounded.
FieldEvidence field_evidence(const ArrayReading& array, const Pose& T_map_imu, const SensorSuite& suite,
                             const MagneticMap& map, const FieldBackground& background,
                             const PlaceSearchOptions& options);

}  // namespace lodestone

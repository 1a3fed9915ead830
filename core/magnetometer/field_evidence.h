#pragma once

#include "core/magnetometer/array_reading.h"
#include "core/magnetometer/magnetic_map.h"

namespace lodestone {

/// Distribution of a site's field at an unknown place: mean and spread over its map.
struct FieldBackground {
  Vector3 mean_ut = Vector3::Zero();  ///< map axes
  double sigma_ut = 1.0;              ///< per component
};

/// Reads the whole map.
FieldBackground field_background(const MagneticMap& map);

// Priors of the search (docs/design/024-initial-pose-search.md), fixed before the test places were drawn.
inline constexpr double kFieldTrust = 0.5;   ///< exponent of the field's likelihood, since its errors are correlated
inline constexpr double kStaleShare = 0.05;  ///< share of the magnetic map that may have changed since the survey

/// Likelihood of an array's readings at a pose.
struct FieldEvidence {
  double log_likelihood = 0.0;   ///< ln p(readings | pose) times kFieldTrust
  int on_map = 0;                ///< number of readings on the map
  double residual_rms_ut = 0.0;  ///< of the readings on the map
};

/// The likelihood of one array's readings at `T_map_imu` (the pose at the reading's T_end_mag reference). The readings
/// are jointly normal. Each has the error of its own magnetometer: sensor_variance_ut2, or more if it has drifted from
/// the others. The map's errors are correlated over 0.3 m across the array and increase with the field's gradient times
/// 3 cm. A reading off the map has the distribution of the background, so that poses on and off the map are comparable.
/// With probability kStaleShare the map has changed here, and all readings are from the background; this limits the
/// evidence of a stale map against the right place.
FieldEvidence field_evidence(const ArrayReading& array, const Pose& T_map_imu, const SensorSuite& suite,
                             const MagneticMap& map, const FieldBackground& background);

/// The same at a place far from any map, where only the attitude counts.
double field_log_likelihood_off_map(const ArrayReading& array, const Quaternion& attitude, const SensorSuite& suite,
                                    const MagneticMap& map, const FieldBackground& background);

}  // namespace lodestone

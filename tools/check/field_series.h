#pragma once

#include <vector>

#include "core/evaluation/field_comparison.h"

namespace lodestone {

/// What one magnetometer read along a drive and what the map says it should have, both in its own axes, µT.
struct FieldSeries {
  std::vector<Time> times;
  std::vector<Vector3> measured_ut;
  std::vector<Vector3> expected_ut;
  std::vector<double> variance_ut2;  ///< of map and pose, a component: alike for neighbours
  std::vector<double> noise_ut2;     ///< of the reading, a component
  double way_m = 0.0;                ///< that the magnetometer went meanwhile

  std::vector<Vector3> differences() const;  ///< measured less expected
};

/// How well a model of what is wrong with one magnetometer explains its readings.
struct FieldModels {
  Vector3 offset_ut = Vector3::Zero();  ///< median difference
  double offset_sigma_ut = 0.0;         ///< of a component, from variances and the way
  double rms_ut = 0.0;                  ///< of the differences as they are (robust, a vector's length)
  double rms_offset_ut = 0.0;           ///< with the offset taken off
  double turn_rad = 0.0;                ///< of the sensor, that explains them best (Wahba's problem)
  double rms_turned_ut = 0.0;           ///< with the turn taken off
  double scale_error = 0.0;             ///< largest departure of the fitted matrix's stretches from 1
  double rms_linear_ut = 0.0;           ///< with a matrix and an offset taken off
  double delay_s = 0.0;                 ///< of its stamps, that explains them best, offset taken off
  double rms_undelayed_ut = 0.0;
  Vector3 drift_ut = Vector3::Zero();  ///< mean difference of the last third less that of the first
  double drift_sigma_ut = 0.0;
  double rms_drift_ut = 0.0;  ///< with an even drift and an offset taken off
};

/// One series a magnetometer, in the order of the suite.
std::vector<FieldSeries> field_series(const FieldComparison& comparison);

/// Throws std::invalid_argument for a series without readings.
FieldModels fit_models(const FieldSeries& series);

}  // namespace lodestone

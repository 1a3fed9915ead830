#pragma once

#include <vector>

#include "core/evaluation/field_comparison.h"

namespace lodestone {

/// The readings of one magnetometer along a path and the map's field at the same times, both in its axes, µT.
struct FieldSeries {
  std::vector<Time> times;
  std::vector<Vector3> measured_ut;
  std::vector<Vector3> expected_ut;
  std::vector<double> variance_ut2;  ///< of map and pose, per component; correlated between neighbours
  std::vector<double> noise_ut2;     ///< of the reading, per component
  double way_m = 0.0;                ///< length of the magnetometer's path

  std::vector<Vector3> differences() const;  ///< measured minus expected
};

/// Models of the faults of one magnetometer, and how well each explains its readings.
struct FieldModels {
  Vector3 offset_ut = Vector3::Zero();  ///< median difference
  double offset_sigma_ut = 0.0;         ///< per component, from variances and path length
  double rms_ut = 0.0;                  ///< of the differences (robust, of vector lengths)
  double rms_offset_ut = 0.0;           ///< after subtracting the offset
  double turn_rad = 0.0;                ///< best rotation of the sensor (Wahba's problem)
  double rms_turned_ut = 0.0;           ///< after the rotation
  double scale_error = 0.0;             ///< largest deviation of the fitted matrix's singular values from 1
  double rms_linear_ut = 0.0;           ///< after correction by matrix and offset
  double delay_s = 0.0;                 ///< best delay of the stamps, after subtracting the offset
  double rms_undelayed_ut = 0.0;
  Vector3 drift_ut = Vector3::Zero();  ///< mean difference of the last third minus that of the first third
  double drift_sigma_ut = 0.0;
  double rms_drift_ut = 0.0;  ///< after subtracting a linear drift and an offset
};

/// One series per magnetometer, in the order of the suite.
std::vector<FieldSeries> field_series(const FieldComparison& comparison);

/// Throws std::invalid_argument for a series without readings.
FieldModels fit_models(const FieldSeries& series);

}  // namespace lodestone

#pragma once

#include <span>

#include "core/magnetometer/array_reading.h"
#include "core/magnetometer/field_evidence.h"
#include "estimators/factory.h"
#include "estimators/mixture/place_component.h"

namespace lodestone {

/// Largest sigma of a component's position with which the field map is linear, m: a third of the smallest length scale
/// of fields near steel (0.24 m).
inline constexpr double kWidestPlace_m = 0.08;

/// A reading at a component: predicted minus measured field, map axes, µT.
struct ReadingFit {
  bool informs = false;  ///< false: the field may be any of the map, and the derivatives are not set
  Vector3 residual_ut = Vector3::Zero();
  double sensor_variance_ut2 = 0.0;  ///< per axis
  double map_variance_ut2 = 0.0;
  Eigen::Matrix<double, 3, 6> by_pose;  ///< rotation and position, the first of the component's error
  Matrix3 by_offset;                    ///< of the reading's magnetometer
  Eigen::Index offset = 0;              ///< first row of this offset in the component's error

  double variance_ut2() const { return sensor_variance_ut2 + map_variance_ut2; }
};

/// The reading at the component's mean. Off the map, and where the component is wider than the field's structure, it
/// informs about nothing: `background` is predicted then.
ReadingFit fit_reading(const MeanReading& reading, const PlaceComponent& component, const EstimatorInput& input,
                       const FieldBackground& background);

/// A third of the trace of the residual's covariance H P Hᵀ by the component's own, µT².
double mean_variance_ut2(const Eigen::MatrixXd& covariance, const ReadingFit& found);

/// A reading that informs about a component, and the variance per axis that it counts with.
struct WeighedFit {
  ReadingFit fit;
  double variance_ut2 = 0.0;
};

/// Kalman updates of a component by readings, all linearized at its mean. The derivative by nine components of the
/// error is used, the others are zero.
void update_by_readings(std::span<const WeighedFit> readings, PlaceComponent& component);

}  // namespace lodestone

#pragma once

#include <ceres/sized_cost_function.h>

#include "core/calibration/magnetometer_calibration.h"

namespace lodestone {

/// A slope of the field that has neither curl nor divergence, as five numbers: xx yy xy xz yz (µT/m), zz = −xx − yy.
using FieldSlope = Eigen::Matrix<double, 5, 1>;

/// The slope's share of the field at `lever` (m) from where it is taken, as a matrix on the five numbers: 3×5.
Eigen::Matrix<double, 3, 5> slope_jacobian(const Vector3& lever);

/// A slope in turned axes, as a matrix on the five numbers: G → Q G Qᵀ.
Eigen::Matrix<double, 5, 5> turned_slope(const Matrix3& Q);

/// A reading against the field of its moment, by the magnetometer's calibration:
///   r = (m − D (Q (f + y + (G + K a) ℓ)) − b) / σ,
/// with f a field that is known, y and the slope G the rest of it, in imu axes, Q = R_imu_magᵀ, ℓ the magnetometer's
/// place. a is what the field here is beyond that of the other places, and K says in how far the slope goes with it:
/// near steel both are large at once, and magnetometers that distort as that slope does would look the same.
/// Parameters: calibration (12: b in µT, then the nine numbers of D), y (3, µT), G (5, µT/m), K (5×3 by rows, 1/m).
class CalibratedReadingFactor final : public ceres::SizedCostFunction<3, 12, 3, 5, 15> {
 public:
  struct Reading {
    Vector3 measured_ut = Vector3::Zero();    ///< m, magnetometer axes
    Vector3 known_ut = Vector3::Zero();       ///< f, imu axes
    Matrix3 R_mag_imu = Matrix3::Identity();  ///< Q
    Vector3 lever_m = Vector3::Zero();        ///< ℓ, imu axes, from where y is taken
    double sigma_ut = 1.0;
    Vector3 anomaly_ut = Vector3::Zero();  ///< a, imu axes
  };

  explicit CalibratedReadingFactor(const Reading& reading);

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  Reading reading_;
  Eigen::Matrix<double, 3, 5> slope_;  // G ℓ in magnetometer axes
};

}  // namespace lodestone

#pragma once

#include <ceres/sized_cost_function.h>

#include <optional>

#include "core/calibration/magnetometer_calibration.h"

namespace lodestone {

/// Gradient of a field without curl and divergence, as five numbers: xx yy xy xz yz (µT/m), zz = −xx − yy.
using FieldSlope = Eigen::Matrix<double, 5, 1>;

/// Change of the field against its map, the same everywhere: share of the map's field, then an offset in µT, map axes.
using MapChange = Eigen::Vector4d;

/// The field difference at `lever` (m) per gradient, as a matrix on the five numbers: 3×5.
Eigen::Matrix<double, 3, 5> slope_jacobian(const Vector3& lever);

/// A gradient in rotated axes, as a matrix on the five numbers: G → Q G Qᵀ.
Eigen::Matrix<double, 5, 5> turned_slope(const Matrix3& Q);

/// A magnetometer reading against the field at its time, as a function of the calibration. Without a map:
///   r = (m − D Q (y + (G + K a) ℓ) − b) / σ,
/// with the field y and its gradient G in imu axes, Q = R_imu_magᵀ, and the magnetometer's position ℓ. a is the
/// difference of the local field from that of other places, and K the part of the gradient that is proportional to a:
/// near steel both are large, and without K, distortions of the magnetometers would explain this. With a map:
///   r = (m − D Q f − D₀ Q (s f + R_imu_map c + v (f − f₀) + y + (G + K a) ℓ) − b) / σ,
/// with the map's field f, its change s and c since the survey, and the map's remaining error y and G. v is a share of
/// the map's variation about its mean f₀: the map's errors make its variation larger than the field's. D₀ is D of the
/// last solution: with D in its place, a larger D would make y and G smaller and so more likely, and the cost's valley
/// along which the scales of magnetometers and field cancel would be curved (docs/design/025).
///
/// Parameters: calibration (12: b in µT, then the nine numbers of D), y (3, µT), G (5, µT/m), K (5×3 by rows, 1/m),
/// change of the map (4: s, then c in µT), v (1).
class CalibratedReadingFactor final : public ceres::SizedCostFunction<3, 12, 3, 5, 15, 4, 1> {
 public:
  struct Reading {
    Vector3 measured_ut = Vector3::Zero();    ///< m, magnetometer axes
    Vector3 known_ut = Vector3::Zero();       ///< f, imu axes; zero without a map
    Matrix3 R_mag_imu = Matrix3::Identity();  ///< Q
    Vector3 lever_m = Vector3::Zero();        ///< ℓ, imu axes, from the point where y is defined
    double sigma_ut = 1.0;
    Vector3 anomaly_ut = Vector3::Zero();      ///< a, imu axes
    Matrix3 R_imu_map = Matrix3::Identity();   ///< if f comes from a map
    Vector3 usual_ut = Vector3::Zero();        ///< f₀, imu axes
    std::optional<Matrix3> last_distortion{};  ///< D₀; empty without a map
  };

  explicit CalibratedReadingFactor(const Reading& reading);

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  Reading reading_;
  Eigen::Matrix<double, 3, 5> slope_;   // G ℓ in magnetometer axes
  Vector3 variation_;                   // Q (f − f₀)
  Eigen::Matrix<double, 3, 4> change_;  // ∂(field)/∂(change of the map), magnetometer axes
};

}  // namespace lodestone

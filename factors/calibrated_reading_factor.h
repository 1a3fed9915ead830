#pragma once

#include <ceres/sized_cost_function.h>

#include <optional>

#include "core/calibration/magnetometer_calibration.h"

namespace lodestone {

/// A slope of the field that has neither curl nor divergence, as five numbers: xx yy xy xz yz (µT/m), zz = −xx − yy.
using FieldSlope = Eigen::Matrix<double, 5, 1>;

/// How the field differs from its map everywhere: share of the map's field, then an offset in µT, map axes.
using MapChange = Eigen::Vector4d;

/// The slope's share of the field at `lever` (m) from where it is taken, as a matrix on the five numbers: 3×5.
Eigen::Matrix<double, 3, 5> slope_jacobian(const Vector3& lever);

/// A slope in turned axes, as a matrix on the five numbers: G → Q G Qᵀ.
Eigen::Matrix<double, 5, 5> turned_slope(const Matrix3& Q);

/// A reading against the field of its moment, by the magnetometer's calibration. Without a map:
///   r = (m − D Q (y + (G + K a) ℓ) − b) / σ,
/// with the field y and its slope G, in imu axes, Q = R_imu_magᵀ, ℓ the magnetometer's place. a is what the field here
/// is beyond that of the other places, and K says in how far the slope goes with it: near steel both are large at once,
/// and magnetometers that distort as that slope does would look the same. With a map:
///   r = (m − D Q f − D₀ Q (s f + R_imu_map c + v (f − f₀) + y + (G + K a) ℓ) − b) / σ,
/// with the map's field f, its change s and c since the survey, and the rest y and G of the map's error. v is a share
/// of the map's variation about its mean f₀: errors of the map make its variation larger than the field's. D₀ is D of
/// the last solution. With D in its place, a larger D would make y and G smaller, and so seem likely; and the valley
/// along which scales of the magnetometers and of the field cancel would be curved.
///
/// Parameters: calibration (12: b in µT, then the nine numbers of D), y (3, µT), G (5, µT/m), K (5×3 by rows, 1/m),
/// change of the map (4: s, then c in µT), v (1).
class CalibratedReadingFactor final : public ceres::SizedCostFunction<3, 12, 3, 5, 15, 4, 1> {
 public:
  struct Reading {
    Vector3 measured_ut = Vector3::Zero();    ///< m, magnetometer axes
    Vector3 known_ut = Vector3::Zero();       ///< f, imu axes; zero without a map
    Matrix3 R_mag_imu = Matrix3::Identity();  ///< Q
    Vector3 lever_m = Vector3::Zero();        ///< ℓ, imu axes, from where y is taken
    double sigma_ut = 1.0;
    Vector3 anomaly_ut = Vector3::Zero();      ///< a, imu axes
    Matrix3 R_imu_map = Matrix3::Identity();   ///< where f comes from a map
    Vector3 usual_ut = Vector3::Zero();        ///< f₀, imu axes
    std::optional<Matrix3> last_distortion{};  ///< D₀; none without a map
  };

  explicit CalibratedReadingFactor(const Reading& reading);

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  Reading reading_;
  Eigen::Matrix<double, 3, 5> slope_;   // G ℓ in magnetometer axes
  Vector3 variation_;                   // Q (f − f₀)
  Eigen::Matrix<double, 3, 4> change_;  // of the field by the change of the map, magnetometer axes
};

}  // namespace lodestone

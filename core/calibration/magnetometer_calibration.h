#pragma once

#include "core/geometry/so3.h"

namespace lodestone {

/// Model of a magnetometer: reading = D field + b, all in its own axes.
struct MagnetometerCalibration {
  Vector3 hard_iron_ut = Vector3::Zero();    ///< b: the reading without field
  Matrix3 distortion = Matrix3::Identity();  ///< D: soft iron, scale, misalignment

  Matrix3 correction() const { return distortion.inverse(); }  ///< field = correction() (reading − hard_iron_ut)
  Vector3 corrected(const Vector3& reading_ut) const { return correction() * (reading_ut - hard_iron_ut); }

  /// The calibration of raw readings, if this calibration is of readings that `given` already corrected.
  MagnetometerCalibration after(const MagnetometerCalibration& given) const {
    return {given.hard_iron_ut + given.distortion * hard_iron_ut, given.distortion * distortion};
  }
};

/// A small distortion as nine numbers: D = I + S + [ω]×, S symmetric, order xx yy zz xy xz yz, then ω (rad). D is
/// linear in the numbers, every 3×3 matrix has its nine, and a small ω is the misalignment.
using Distortion = Eigen::Matrix<double, 9, 1>;

/// D of the nine numbers.
Matrix3 distortion_matrix(const Distortion& distortion);

/// The nine numbers of any D.
Distortion distortion_of(const Matrix3& matrix);

/// ∂(D v)/∂ nine numbers, 3×9.
Eigen::Matrix<double, 3, 9> distortion_jacobian(const Vector3& v);

/// The same distortion in other axes, as a matrix on the nine numbers: D → Q D Qᵀ. `Q` is a rotation.
Eigen::Matrix<double, 9, 9> turned_distortion(const Matrix3& Q);

}  // namespace lodestone

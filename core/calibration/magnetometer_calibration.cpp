#include "core/calibration/magnetometer_calibration.h"

namespace lodestone {

Matrix3 distortion_matrix(const Distortion& e) {
  Matrix3 symmetric;
  symmetric << e[0], e[3], e[4],  //
      e[3], e[1], e[5],           //
      e[4], e[5], e[2];
  return Matrix3::Identity() + symmetric + so3::hat(e.tail<3>());
}

Distortion distortion_of(const Matrix3& matrix) {
  const Matrix3 E = matrix - Matrix3::Identity();
  const Matrix3 symmetric = 0.5 * (E + E.transpose());
  const Matrix3 skew = 0.5 * (E - E.transpose());
  Distortion e;
  e << symmetric(0, 0), symmetric(1, 1), symmetric(2, 2), symmetric(0, 1), symmetric(0, 2), symmetric(1, 2), skew(2, 1),
      skew(0, 2), skew(1, 0);
  return e;
}

Eigen::Matrix<double, 3, 9> distortion_jacobian(const Vector3& v) {
  Eigen::Matrix<double, 3, 9> jacobian = Eigen::Matrix<double, 3, 9>::Zero();
  jacobian.leftCols<3>() = v.asDiagonal();
  jacobian.block<3, 3>(0, 3) << v.y(), v.z(), 0.0,  //
      v.x(), 0.0, v.z(),                            //
      0.0, v.x(), v.y();
  jacobian.rightCols<3>() = -so3::hat(v);
  return jacobian;
}

Eigen::Matrix<double, 9, 9> turned_distortion(const Matrix3& Q) {
  Eigen::Matrix<double, 9, 9> turned;
  for (int i = 0; i < 9; ++i) turned.col(i) = distortion_of(Q * distortion_matrix(Distortion::Unit(i)) * Q.transpose());
  return turned;
}

}  // namespace lodestone

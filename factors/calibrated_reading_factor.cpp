#include "factors/calibrated_reading_factor.h"

#include "factors/row_major.h"

namespace lodestone {

namespace {

Matrix3 slope_matrix(const FieldSlope& g) {
  Matrix3 slope;
  slope << g[0], g[2], g[3],  //
      g[2], g[1], g[4],       //
      g[3], g[4], -g[0] - g[1];
  return slope;
}

}  // namespace

Eigen::Matrix<double, 3, 5> slope_jacobian(const Vector3& l) {
  Eigen::Matrix<double, 3, 5> jacobian;
  jacobian << l.x(), 0.0, l.y(), l.z(), 0.0,  //
      0.0, l.y(), l.x(), 0.0, l.z(),          //
      -l.z(), -l.z(), 0.0, l.x(), l.y();
  return jacobian;
}

Eigen::Matrix<double, 5, 5> turned_slope(const Matrix3& Q) {
  Eigen::Matrix<double, 5, 5> turned;
  for (int i = 0; i < 5; ++i) {
    const Matrix3 slope = Q * slope_matrix(FieldSlope::Unit(i)) * Q.transpose();
    turned.col(i) << slope(0, 0), slope(1, 1), slope(0, 1), slope(0, 2), slope(1, 2);
  }
  return turned;
}

CalibratedReadingFactor::CalibratedReadingFactor(const Reading& reading)
    : reading_(reading), slope_(reading.R_mag_imu * slope_jacobian(reading.lever_m)) {
  variation_ = reading.R_mag_imu * (reading.known_ut - reading.usual_ut);
  change_ << reading.R_mag_imu * reading.known_ut, reading.R_mag_imu * reading.R_imu_map;
}

bool CalibratedReadingFactor::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  const Eigen::Map<const Vector3> offset(parameters[0]);
  const Matrix3 D = distortion_matrix(Eigen::Map<const Distortion>(parameters[0] + 3));
  const Eigen::Map<const Vector3> rest(parameters[1]);
  const Eigen::Map<const FieldSlope> slope(parameters[2]);
  const Eigen::Map<const Eigen::Matrix<double, 5, 3, Eigen::RowMajor>> coupling(parameters[3]);
  const Eigen::Map<const MapChange> change(parameters[4]);
  const Matrix3& D_rest = reading_.last_distortion ? *reading_.last_distortion : D;
  const Vector3 known = reading_.R_mag_imu * reading_.known_ut;
  const Vector3 field = reading_.R_mag_imu * rest + slope_ * (slope + coupling * reading_.anomaly_ut) +
                        change_ * change + variation_ * parameters[5][0];
  const double weight = 1.0 / reading_.sigma_ut;
  Eigen::Map<Vector3> residual(residuals);
  residual = weight * (reading_.measured_ut - D * known - D_rest * field - offset);
  if (jacobians == nullptr) return true;
  if (jacobians[0] != nullptr) {
    auto jacobian = row_major<3, 12>(jacobians[0]);
    jacobian.leftCols<3>() = -weight * Matrix3::Identity();
    jacobian.rightCols<9>() = -weight * distortion_jacobian(reading_.last_distortion ? known : Vector3(known + field));
  }
  if (jacobians[1] != nullptr) row_major<3, 3>(jacobians[1]) = -weight * D_rest * reading_.R_mag_imu;
  if (jacobians[2] != nullptr) row_major<3, 5>(jacobians[2]) = -weight * D_rest * slope_;
  if (jacobians[3] != nullptr) {
    auto jacobian = row_major<3, 15>(jacobians[3]);
    for (int i = 0; i < 5; ++i) {
      jacobian.middleCols<3>(3 * i) = -weight * (D_rest * slope_.col(i)) * reading_.anomaly_ut.transpose();
    }
  }
  if (jacobians[4] != nullptr) row_major<3, 4>(jacobians[4]) = -weight * D_rest * change_;
  if (jacobians[5] != nullptr) {
    Eigen::Map<Vector3> jacobian(jacobians[5]);
    jacobian = -weight * D_rest * variation_;
  }
  return true;
}

}  // namespace lodestone

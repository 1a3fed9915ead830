#include "core/magnetometer/field_residual.h"

namespace lodestone {

FieldResidual field_residual(const Pose& T_map_imu, const Pose& T_imu_mag, const Vector3& measured_ut,
                             const FieldValue& map) {
  const Matrix3 R_map_imu = T_map_imu.rotation.toRotationMatrix();
  const Matrix3 R_mag_imu = T_imu_mag.rotation.conjugate().toRotationMatrix();
  const Vector3 field_imu = R_map_imu.transpose() * map.field_ut;
  const Matrix3 gradient_imu_map = R_map_imu.transpose() * map.gradient;
  FieldResidual result;
  result.residual_ut = measured_ut - R_mag_imu * field_imu;
  result.jacobian.leftCols<3>() =
      -R_mag_imu * (so3::hat(field_imu) - gradient_imu_map * R_map_imu * so3::hat(T_imu_mag.position));
  result.jacobian.rightCols<3>() = -R_mag_imu * gradient_imu_map;
  return result;
}

}  // namespace lodestone

#include "estimators/initial_state.h"

#include "core/angles.h"

namespace lodestone {

InitialState initial_state(const Pose& T_map_imu, const Vector3& velocity, double gravity_m_s2,
                           const InitialOptions& options) {
  InitialState result;
  result.state.T_map_imu = T_map_imu;
  result.state.velocity = velocity;
  result.state.gravity = Vector3(0.0, 0.0, -gravity_m_s2);
  Vector17 sigma;
  sigma.segment<3>(tangent::rotation).setConstant(options.rotation_sigma_deg * degree);
  sigma.segment<3>(tangent::position).setConstant(options.position_sigma_m);
  sigma.segment<3>(tangent::velocity).setConstant(options.velocity_sigma_m_s);
  sigma.segment<3>(tangent::gyroscope_bias).setConstant(options.gyroscope_bias_sigma_rad_s);
  sigma.segment<3>(tangent::accelerometer_bias).setConstant(options.accelerometer_bias_sigma_m_s2);
  sigma.segment<2>(tangent::gravity).setConstant(options.gravity_sigma_deg * degree);
  result.covariance = sigma.cwiseAbs2().asDiagonal();
  return result;
}

}  // namespace lodestone

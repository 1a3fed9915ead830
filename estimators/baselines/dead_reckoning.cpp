#include "estimators/baselines/dead_reckoning.h"

#include "core/wheels/wheel_residual.h"
#include "estimators/layer_height.h"

namespace lodestone {

void update_by_wheels(const ScanBundle& bundle, const SensorSuite& suite, const Matrix17& total, StateCloud& cloud,
                      Diagnostics& diagnostics) {
  if (!suite.wheels) return;
  const WheelCalibrationSigmas& sigmas = suite.calibration.wheels;
  const NavState& nominal = cloud.nominal();
  auto reading = average_wheels(bundle.wheels, nominal, bundle.imu, *suite.wheels);
  if (!reading) return;
  diagnostics.wheel_weight = weigh_wheels(nominal, total, {}, sigmas, kWheelProbability, *reading);
  const auto residual_at = [&](const NavState& state) {
    return wheel_residual(*reading, state.T_map_imu.rotation, state.velocity, state.gyroscope_bias, {});
  };
  const double step_s = to_seconds(bundle.imu.back().time - bundle.imu.front().time);
  const WheelResidual predicted = residual_at(nominal);
  cloud.update([&](const NavState& state) { return residual_at(state).value; }, predicted.by_state(),
               wheel_noise(predicted, sigmas, step_s));
}

void update_by_height(const SensorSuite& suite, double height_m, StateCloud& cloud) {
  const Vector3 center = array_center(suite);
  Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(1, tangent::size);
  jacobian.leftCols<6>() = height_by_pose(cloud.nominal().T_map_imu, center);
  const auto residual = [&](const NavState& state) {
    return Eigen::VectorXd::Constant(1, (state.T_map_imu * center).z() - height_m);
  };
  cloud.update(residual, jacobian, Eigen::MatrixXd::Constant(1, 1, kLayerHeightSigma_m * kLayerHeightSigma_m));
}

}  // namespace lodestone

#include "estimators/baselines/dead_reckoning.h"

#include <algorithm>
#include <cmath>

#include "core/wheels/wheel_residual.h"

namespace lodestone {

namespace {

constexpr double kLayerHeightSigma_m = 0.02;

}  // namespace

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
  // Errors of the calibration are white noise with the integral of the slip, as in the filter
  // (docs/design/049-wheels.md).
  const double step_s = to_seconds(bundle.imu.back().time - bundle.imu.front().time);
  const double repeats = std::max(1.0, 2.0 * kSlipCorrelation_s / step_s);
  const WheelResidual predicted = residual_at(nominal);
  const Eigen::Vector4d variance = repeats * wheel_calibration_variance(sigmas);
  const Matrix3 noise =
      Matrix3::Identity() + predicted.by_calibration * variance.asDiagonal() * predicted.by_calibration.transpose();
  cloud.update([&](const NavState& state) { return residual_at(state).value; }, predicted.by_state(), noise);
}

void update_by_height(const SensorSuite& suite, double height_m, StateCloud& cloud) {
  Vector3 mean = Vector3::Zero();
  for (const MagnetometerModel& magnetometer : suite.magnetometers) mean += magnetometer.T_imu_mag.position;
  mean /= static_cast<double>(suite.magnetometers.size());
  Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(1, tangent::size);
  jacobian.block<1, 3>(0, tangent::rotation) =
      -(cloud.nominal().T_map_imu.rotation.toRotationMatrix() * so3::hat(mean)).row(2);
  jacobian(0, tangent::position + 2) = 1.0;
  const auto residual = [&](const NavState& state) {
    return Eigen::VectorXd::Constant(1, (state.T_map_imu * mean).z() - height_m);
  };
  cloud.update(residual, jacobian, Eigen::MatrixXd::Constant(1, 1, kLayerHeightSigma_m * kLayerHeightSigma_m));
}

}  // namespace lodestone

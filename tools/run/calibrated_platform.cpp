#include "tools/run/calibrated_platform.h"

#include <Eigen/LU>
#include <algorithm>

#include "core/angles.h"

namespace lodestone {

namespace {

/// Reduces the platform file's sigma to `largest`, the largest remaining sigma. 0: not estimated.
void reduce_sigma(double& sigma, double largest) {
  if (largest > 0.0) sigma = std::min(sigma, largest);
}

void calibrate_lidars(Platform& platform, const CalibrationEstimate::Lidar& lidar) {
  const bool moved = !lidar.correction.turn_rad.isZero(0.0) || !lidar.correction.shift_m.isZero(0.0);
  if (moved) {
    const std::vector<LidarModel> lidars = lidar.correction.corrected(platform.suite.lidars());
    platform.suite.lidar = lidars.front();
    platform.suite.further_lidars.assign(lidars.begin() + 1, lidars.end());
  }
  for (LidarMessageLayout& further : platform.further_lidars) further.clock_offset_s += lidar.correction.clock_s;
  platform.lidar.clock_offset_s += lidar.correction.clock_s;
  LidarCalibrationSigmas& sigmas = platform.suite.calibration.lidar;
  reduce_sigma(sigmas.rotation_sigma_deg, degrees_per_radian * lidar.turn_sigma_rad.maxCoeff());
  reduce_sigma(sigmas.translation_sigma_m, lidar.shift_sigma_m.maxCoeff());
  reduce_sigma(sigmas.clock_sigma_s, lidar.clock_sigma_s);
}

void calibrate_magnetometer(MagnetometerModel& model, MagnetometerMessageLayout& layout,
                            const CalibrationEstimate::Magnetometer& estimate) {
  if (estimate.turn_rad.isZero(0.0) && estimate.distortion.isZero(0.0)) return;
  Eigen::Matrix<double, CalibrationEstimate::kMatrixParameters, 1> parameters;
  parameters << estimate.turn_rad, estimate.distortion;
  const Matrix3 read = Matrix3::Identity() + CalibrationEstimate::matrix_of(parameters.data());
  const Quaternion turn = so3::exp(estimate.turn_rad);
  model.T_imu_mag.rotation = (model.T_imu_mag.rotation * turn).normalized();
  layout.soft_iron_correction = turn.conjugate() * (read.inverse() * layout.soft_iron_correction).eval();
}

void calibrate_wheels(Platform& platform, const CalibrationEstimate::Wheels& estimate) {
  if (!platform.suite.wheels) return;
  // Only if estimated: a product may differ in the last bit.
  if (estimate.scale_sigma > 0.0) platform.wheels.scale *= 1.0 + estimate.correction.scale;
  WheelModel& model = *platform.suite.wheels;
  if (!estimate.correction.turn_rad.isZero(0.0)) model.T_imu_wheels = estimate.correction.corrected(model.T_imu_wheels);
  WheelCalibrationSigmas& sigmas = platform.suite.calibration.wheels;
  reduce_sigma(sigmas.scale_sigma, estimate.scale_sigma);
  reduce_sigma(sigmas.rotation_sigma_deg, degrees_per_radian * estimate.turn_sigma_rad.maxCoeff());
}

}  // namespace

Platform calibrated_platform(Platform platform, const SensorSuite& suite, const CalibrationEstimate& estimate) {
  calibrate_lidars(platform, estimate.lidar);
  calibrate_wheels(platform, estimate.wheels);
  platform.magnetometer_clock_offset_s += estimate.magnetometer_clock_s;
  MagnetometerCalibrationSigmas& sigmas = platform.suite.calibration.magnetometers;
  reduce_sigma(sigmas.clock_sigma_s, estimate.magnetometer_clock_sigma_s);
  double turn_sigma_rad = 0.0, distortion_sigma = 0.0;
  std::size_t found = 0;
  for (std::size_t i = 0; i < platform.suite.magnetometers.size(); ++i) {
    for (std::size_t k = 0; k < std::min(estimate.magnetometers.size(), suite.magnetometers.size()); ++k) {
      MagnetometerModel& model = platform.suite.magnetometers[i];
      if (suite.magnetometers[k].name != model.name) continue;
      const CalibrationEstimate::Magnetometer& one = estimate.magnetometers[k];
      calibrate_magnetometer(model, platform.magnetometers[i], one);
      turn_sigma_rad = std::max(turn_sigma_rad, one.turn_sigma_rad.maxCoeff());
      distortion_sigma = std::max(distortion_sigma, one.distortion_sigma.maxCoeff());
      ++found;
    }
  }
  if (found < platform.suite.magnetometers.size()) return platform;
  reduce_sigma(sigmas.rotation_sigma_deg, degrees_per_radian * turn_sigma_rad);
  reduce_sigma(sigmas.matrix_sigma, distortion_sigma);
  return platform;
}

}  // namespace lodestone

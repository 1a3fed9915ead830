#include "estimators/smoother/field_pose.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <cmath>

#include "core/magnetometer/localization.h"

namespace lodestone {

MeasuredPose field_pose(std::span<const std::vector<FieldReading>> arrays, const Pose& T_map_imu,
                        const Matrix6& covariance, const MagneticMap& map, FieldInterpolation interpolation,
                        double unseen_gain) {
  MagneticLocalizationOptions options;
  options.interpolation = interpolation;
  options.map_sigma = false;  // already contained in the readings' sigmas
  // Each sample alone gives a quadratic cost about its own best pose; their sum is expressed about the prediction.
  Matrix6 information = Matrix6::Zero();
  Vector6 gradient = Vector6::Zero();
  for (const std::vector<FieldReading>& array : arrays) {
    if (array.empty()) continue;
    std::vector<LocalizationReading> readings;
    double weight = 0.0;  // of the array; rejected readings have weight zero
    for (const FieldReading& reading : array) {
      if (reading.weight == 0.0) continue;
      weight = reading.weight;
      readings.push_back({reading.T_end_mag, reading.measured_ut, reading.sigma_ut * reading.sigma_ut});
    }
    const MagneticLocalization found = localize(T_map_imu, covariance, readings, map, options);
    if (found.used == 0 || !found.converged) continue;
    information += weight * found.information;
    gradient += weight * (found.gradient - found.information * found.T_map_imu.boxminus(T_map_imu));
  }
  // Scaled by the prior sigmas, so that radians and metres are comparable.
  const Matrix6 prior_root = covariance.llt().matrixL();
  const Eigen::SelfAdjointEigenSolver<Matrix6> solver(prior_root.transpose() * information * prior_root);
  const Matrix6 directions = prior_root * solver.eigenvectors();
  const Matrix6 to_directions = directions.inverse();
  MeasuredPose result;
  Vector6 step = Vector6::Zero();
  for (int i = 0; i < 6; ++i) {
    const double gain = solver.eigenvalues()[i];
    if (!(gain > unseen_gain)) continue;
    step -= directions.col(i) * (directions.col(i).dot(gradient) / gain);
    result.root.row(i) = std::sqrt(gain) * to_directions.row(i);
  }
  result.T_map_imu = T_map_imu.boxplus(step);
  return result;
}

}  // namespace lodestone

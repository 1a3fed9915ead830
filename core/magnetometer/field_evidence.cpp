#include "core/magnetometer/field_evidence.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/log_mixture.h"

namespace lodestone {

namespace {

constexpr double kLeastMapSigma_ut = 0.5;
constexpr double kBackgroundCorrelation_m = 0.5;
constexpr double kMapCorrelation_m = 0.3;    // errors of the magnetic map are one over this distance
constexpr double kRegisteredSigma_m = 0.03;  // of a candidate once it is registered

double log_normal(const Eigen::VectorXd& residual, const Eigen::MatrixXd& covariance) {
  const Eigen::LLT<Eigen::MatrixXd> factor(covariance);
  const Eigen::VectorXd white = factor.matrixL().solve(residual);
  const double log_root = factor.matrixLLT().diagonal().array().log().sum();
  return -0.5 * white.squaredNorm() - log_root -
         0.5 * std::log(2.0 * std::numbers::pi) * static_cast<double>(residual.size());
}

/// Variance of each magnetometer's own error (µT², per component): by its sigmas or, of three or more, by its distance
/// from their middle, as far as the field's change across the array does not explain it. The larger of both.
Eigen::VectorXd own_variances(const ArrayReading& array, const SensorSuite& suite, double field_sigma_ut) {
  const std::size_t count = array.readings.size();
  Eigen::VectorXd result(static_cast<Eigen::Index>(count));
  std::vector<Vector3> measured_ut;
  Vector3 center_m = Vector3::Zero();
  for (const MeanReading& reading : array.readings) {
    result[static_cast<Eigen::Index>(measured_ut.size())] = sensor_variance_ut2(reading, suite);
    measured_ut.push_back(reading.T_end_mag.rotation * reading.measured_ut);
    center_m += reading.T_end_mag.position / static_cast<double>(count);
  }
  if (count < 3) return result;
  const Vector3 middle_ut = middle_of(measured_ut);
  for (std::size_t i = 0; i < count; ++i) {
    const double from_center_m = (array.readings[i].T_end_mag.position - center_m).norm();
    const double by_field =
        2.0 * field_sigma_ut * field_sigma_ut * (1.0 - std::exp(-from_center_m / kBackgroundCorrelation_m));
    double& variance = result[static_cast<Eigen::Index>(i)];
    variance = std::max(variance, (measured_ut[i] - middle_ut).squaredNorm() / 3.0 - by_field);
  }
  return result;
}

/// Sums over the components. Their errors are independent, so one covariance matrix serves all three.
double log_likelihood(const Eigen::MatrixX3d& residuals, const Eigen::MatrixXd& covariance) {
  double sum = 0.0;
  for (int axis = 0; axis < 3; ++axis) sum += log_normal(residuals.col(axis), covariance);
  return sum;
}

}  // namespace

FieldBackground field_background(const MagneticMap& map) {
  Vector3 sum = Vector3::Zero();
  double squares = 0.0;
  std::int64_t count = 0;
  map.for_each_node([&](const Eigen::Vector4f& node) {
    if (!(static_cast<double>(node.w()) <= map.max_sigma_ut())) return;
    const Vector3 field = node.head<3>().cast<double>();
    sum += field;
    squares += field.squaredNorm();
    ++count;
  });
  FieldBackground result;
  if (count == 0) return result;
  result.mean_ut = sum / static_cast<double>(count);
  const double variance = squares / static_cast<double>(count) - result.mean_ut.squaredNorm();
  result.sigma_ut = std::max(1.0, std::sqrt(std::max(0.0, variance) / 3.0));
  return result;
}

FieldEvidence field_evidence(const ArrayReading& array, const Pose& T_map_imu, const SensorSuite& suite,
                             const MagneticMap& map, const FieldBackground& background) {
  FieldEvidence result;
  const auto count = static_cast<Eigen::Index>(array.readings.size());
  if (count == 0) return result;
  Eigen::MatrixX3d residuals(count, 3);
  Eigen::MatrixX3d background_residuals(count, 3);
  const Eigen::VectorXd noise = own_variances(array, suite, background.sigma_ut);
  Eigen::VectorXd sigma(count);
  double squares = 0.0;
  for (Eigen::Index i = 0; i < count; ++i) {
    const MeanReading& reading = array.readings[static_cast<std::size_t>(i)];
    const Vector3 measured = (T_map_imu.rotation * reading.T_end_mag.rotation) * reading.measured_ut;  // map axes
    background_residuals.row(i) = (measured - background.mean_ut).transpose();
    const auto field = map.query(T_map_imu * reading.T_end_mag.position, FieldInterpolation::bilinear);
    if (field) {
      residuals.row(i) = (measured - field->field_ut).transpose();
      sigma[i] = std::sqrt(std::pow(std::max(field->sigma_ut, kLeastMapSigma_ut), 2) +
                           field->gradient.squaredNorm() / 3.0 * std::pow(kRegisteredSigma_m, 2));
      squares += residuals.row(i).squaredNorm();
      ++result.on_map;
    } else {
      residuals.row(i) = background_residuals.row(i);
      sigma[i] = background.sigma_ut;
    }
  }
  if (result.on_map > 0) result.residual_rms_ut = std::sqrt(squares / (3.0 * result.on_map));
  Eigen::MatrixXd covariance = noise.asDiagonal();
  Eigen::MatrixXd background_covariance = noise.asDiagonal();
  for (Eigen::Index i = 0; i < count; ++i) {
    for (Eigen::Index j = 0; j < count; ++j) {
      const double distance_m = (array.readings[static_cast<std::size_t>(i)].T_end_mag.position -
                                 array.readings[static_cast<std::size_t>(j)].T_end_mag.position)
                                    .norm();
      covariance(i, j) += sigma[i] * sigma[j] * std::exp(-distance_m / kMapCorrelation_m);
      background_covariance(i, j) +=
          background.sigma_ut * background.sigma_ut * std::exp(-distance_m / kBackgroundCorrelation_m);
    }
  }
  const double by_background = log_likelihood(background_residuals, background_covariance);
  const double by_map = result.on_map > 0 ? log_likelihood(residuals, covariance) : by_background;
  result.log_likelihood = kFieldTrust * log_mixture(kStaleShare, by_map, by_background);
  return result;
}

double field_log_likelihood_off_map(const ArrayReading& array, const Quaternion& attitude, const SensorSuite& suite,
                                    const MagneticMap& map, const FieldBackground& background) {
  const Pose far{attitude, Vector3::Constant(1e7)};
  return field_evidence(array, far, suite, map, background).log_likelihood;
}

}  // namespace lodestone

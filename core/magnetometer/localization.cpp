#include "core/magnetometer/localization.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "core/magnetometer/field_residual.h"

namespace lodestone {
namespace {

/// The field's part of the cost at one pose. Weights are given, so that two poses can be compared.
struct Evaluation {
  Matrix6 information = Matrix6::Zero();
  Vector6 gradient = Vector6::Zero();
  double cost = 0.0;              ///< ½ Σ r²/σ²
  double squared_residual = 0.0;  ///< µT²
  std::vector<double> map_variance;
};

/// False if a reading has no field at this pose.
bool evaluate(const std::vector<LocalizationReading>& readings, const std::vector<double>& weights, const Pose& pose,
              const MagneticMap& map, FieldInterpolation interpolation, Evaluation& result) {
  result = Evaluation{};
  for (std::size_t i = 0; i < readings.size(); ++i) {
    const auto field = map.query(pose * readings[i].T_imu_mag.position, interpolation);
    if (!field) return false;
    const FieldResidual residual = field_residual(pose, readings[i].T_imu_mag, readings[i].measured_ut, *field);
    result.information += weights[i] * residual.jacobian.transpose() * residual.jacobian;
    result.gradient += weights[i] * residual.jacobian.transpose() * residual.residual_ut;
    result.cost += 0.5 * weights[i] * residual.residual_ut.squaredNorm();
    result.squared_residual += residual.residual_ut.squaredNorm();
    result.map_variance.push_back(field->sigma_ut * field->sigma_ut);
  }
  return true;
}

/// ∂(x ⊟ x₀)/∂x in the pose's tangent order: J_r⁻¹ for rotation, the identity for position.
Matrix6 boxminus_jacobian(const Vector6& difference) {
  Matrix6 jacobian = Matrix6::Identity();
  jacobian.topLeftCorner<3, 3>() = so3::right_jacobian_inverse(difference.head<3>());
  return jacobian;
}

void report_directions(const Matrix6& prior_root, MagneticLocalization& result) {
  const Eigen::SelfAdjointEigenSolver<Matrix6> solver(prior_root.transpose() * result.information * prior_root);
  result.gain = solver.eigenvalues().reverse().cwiseMax(0.0);
  result.directions = prior_root * solver.eigenvectors().rowwise().reverse();
}

}  // namespace

MagneticLocalization localize(const Pose& predicted, const Matrix6& prior, const MagneticArraySample& sample,
                              const SensorSuite& suite, const MagneticMap& map,
                              const MagneticLocalizationOptions& options, std::span<const Vector3> bias_ut) {
  const std::size_t count = suite.magnetometers.size();
  if (sample.field_ut.size() != count || (!bias_ut.empty() && bias_ut.size() != count)) {
    throw std::invalid_argument("localize: one reading and one bias are required for each magnetometer of the suite");
  }
  std::vector<LocalizationReading> readings;
  for (std::size_t j = 0; j < count; ++j) {
    if (!sample.field_ut[j]) continue;
    const MagnetometerModel& model = suite.magnetometers[j];
    const Vector3 bias = bias_ut.empty() ? Vector3::Zero() : bias_ut[j];
    readings.push_back({model.T_imu_mag, *sample.field_ut[j] - bias, model.noise_ut * model.noise_ut});
  }
  return localize(predicted, prior, readings, map, options);
}

MagneticLocalization localize(const Pose& predicted, const Matrix6& prior, std::span<const LocalizationReading> given,
                              const MagneticMap& map, const MagneticLocalizationOptions& options) {
  const Eigen::LLT<Matrix6> prior_cholesky(prior);
  if (prior_cholesky.info() != Eigen::Success || !prior.allFinite()) {
    throw std::invalid_argument("localize: the prior covariance must be positive definite");
  }
  const Matrix6 prior_information = prior_cholesky.solve(Matrix6::Identity());
  const Matrix6 prior_root = prior_cholesky.matrixL();

  MagneticLocalization result;
  result.T_map_imu = predicted;
  std::vector<LocalizationReading> readings;
  for (const LocalizationReading& reading : given) {
    if (map.query(predicted * reading.T_imu_mag.position, options.interpolation)) {
      readings.push_back(reading);
    } else {
      ++result.off_map;
    }
  }
  result.used = static_cast<int>(readings.size());

  std::vector<double> weights(readings.size());
  const auto weigh = [&](const std::vector<double>& map_variance) {
    for (std::size_t i = 0; i < readings.size(); ++i) {
      weights[i] = 1.0 / (readings[i].variance_ut2 + (options.map_sigma ? map_variance[i] : 0.0));
    }
  };

  Evaluation now;
  evaluate(readings, weights, predicted, map, options.interpolation, now);  // for the map's variances
  weigh(now.map_variance);
  evaluate(readings, weights, predicted, map, options.interpolation, now);

  while (!readings.empty() && !result.converged && result.iterations < options.max_iterations) {
    ++result.iterations;
    const Vector6 difference = result.T_map_imu.boxminus(predicted);
    const Matrix6 jacobian = boxminus_jacobian(difference);
    const Matrix6 trust = jacobian.transpose() * prior_information * jacobian;
    const Vector6 gradient = now.gradient + jacobian.transpose() * prior_information * difference;
    const double cost = now.cost + 0.5 * difference.dot(prior_information * difference);

    // The prior makes the normal matrix regular, so the step descends; it is shortened until the cost falls. If no step
    // longer than the tolerance lowers the cost, this is the minimum. Its slope may not be zero: bilinear interpolation
    // has kinks.
    Vector6 step = -(now.information + trust).ldlt().solve(gradient);
    double length = std::sqrt(step.dot(trust * step));  // in prior sigmas
    for (;; step *= 0.3, length *= 0.3) {
      const Pose next = result.T_map_imu.boxplus(step);
      const Vector6 next_difference = next.boxminus(predicted);
      Evaluation then;
      const bool falls = evaluate(readings, weights, next, map, options.interpolation, then) &&
                         then.cost + 0.5 * next_difference.dot(prior_information * next_difference) <= cost;
      result.converged = length < options.step_tolerance;
      if (falls) {
        result.T_map_imu = next;
        if (options.map_sigma) {  // the new place has its own map sigma
          weigh(then.map_variance);
          evaluate(readings, weights, next, map, options.interpolation, then);
        }
        now = std::move(then);
      }
      if (falls || result.converged) break;
    }
  }

  result.information = now.information;
  result.gradient = now.gradient;
  result.covariance = (now.information + prior_information).ldlt().solve(Matrix6::Identity());
  result.residual_rms_ut =
      std::sqrt(now.squared_residual / (3.0 * std::max<double>(static_cast<double>(readings.size()), 1.0)));
  report_directions(prior_root, result);
  return result;
}

}  // namespace lodestone

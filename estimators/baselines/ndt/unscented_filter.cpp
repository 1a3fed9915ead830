#include "estimators/baselines/ndt/unscented_filter.h"

#include <Eigen/Cholesky>
#include <limits>

namespace lodestone {

namespace {

constexpr double kLambda = 1.0;

/// Sigma points after a function, with their weighted mean.
struct TransformedPoints {
  Eigen::MatrixXd points;  ///< one a column
  Eigen::VectorXd mean;

  Eigen::MatrixXd deviations() const { return points.colwise() - mean; }
};

TransformedPoints transform_points(const Eigen::MatrixXd& points, const Eigen::VectorXd& weights,
                                   const VectorFunction& f) {
  const Eigen::VectorXd first = f(points.col(0));
  TransformedPoints result{Eigen::MatrixXd(first.size(), points.cols()), {}};
  result.points.col(0) = first;
  for (Eigen::Index i = 1; i < points.cols(); ++i) result.points.col(i) = f(points.col(i));
  result.mean = result.points * weights;
  return result;
}

Eigen::MatrixXd symmetric(const Eigen::MatrixXd& matrix) {
  return 0.5 * (matrix + matrix.transpose());
}

}  // namespace

Eigen::MatrixXd sigma_points(const GaussianState& state) {
  const Eigen::Index n = state.mean.size();
  Eigen::MatrixXd points = state.mean.replicate(1, 2 * n + 1);
  const Eigen::LLT<Eigen::MatrixXd> factor((static_cast<double>(n) + kLambda) * state.covariance);
  if (factor.info() != Eigen::Success) {
    points.setConstant(std::numeric_limits<double>::quiet_NaN());
    return points;
  }
  const Eigen::MatrixXd root = factor.matrixL();
  points.middleCols(1, n) += root;
  points.rightCols(n) -= root;
  return points;
}

Eigen::VectorXd sigma_weights(Eigen::Index n) {
  const double sum = static_cast<double>(n) + kLambda;
  Eigen::VectorXd weights = Eigen::VectorXd::Constant(2 * n + 1, 0.5 / sum);
  weights[0] = kLambda / sum;
  return weights;
}

GaussianState unscented_prediction(const GaussianState& state, const VectorFunction& f, const Eigen::MatrixXd& noise) {
  const Eigen::VectorXd weights = sigma_weights(state.mean.size());
  const TransformedPoints moved = transform_points(sigma_points(state), weights, f);
  const Eigen::MatrixXd deviations = moved.deviations();
  return {moved.mean, symmetric(deviations * weights.asDiagonal() * deviations.transpose() + noise)};
}

GaussianState unscented_update(const GaussianState& state, const VectorFunction& h, const Eigen::VectorXd& z,
                               const Eigen::MatrixXd& noise) {
  const Eigen::Index n = state.mean.size();
  const Eigen::Index m = z.size();
  GaussianState extended{Eigen::VectorXd::Zero(n + m), Eigen::MatrixXd::Zero(n + m, n + m)};
  extended.mean.head(n) = state.mean;
  extended.covariance.topLeftCorner(n, n) = state.covariance;
  extended.covariance.bottomRightCorner(m, m) = noise;

  const Eigen::MatrixXd points = sigma_points(extended);
  const Eigen::VectorXd weights = sigma_weights(n + m);
  const TransformedPoints expected = transform_points(
      points, weights, [&](const Eigen::VectorXd& x) -> Eigen::VectorXd { return h(x.head(n)) + x.tail(m); });
  const Eigen::MatrixXd deviations = expected.deviations();
  const Eigen::MatrixXd innovation = deviations * weights.asDiagonal() * deviations.transpose();
  const Eigen::MatrixXd cross =
      (points.topRows(n).colwise() - state.mean) * weights.asDiagonal() * deviations.transpose();
  // K = C S⁻¹
  const Eigen::MatrixXd gain = innovation.llt().solve(cross.transpose()).transpose();
  return {state.mean + gain * (z - expected.mean), symmetric(state.covariance - gain * innovation * gain.transpose())};
}

}  // namespace lodestone

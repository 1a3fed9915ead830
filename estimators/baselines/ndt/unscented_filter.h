#pragma once

#include <Eigen/Core>
#include <functional>

namespace lodestone {

/// Mean and covariance of a state vector.
struct GaussianState {
  Eigen::VectorXd mean;        ///< n
  Eigen::MatrixXd covariance;  ///< n × n, positive definite
};

/// The 2 n + 1 sigma points of a state (Julier, Uhlmann 2004), one a column: the mean, and the mean ± the columns of
/// the Cholesky factor of (n + λ) P. λ = 1, as in hdl_localization. Not numbers if P is not positive definite.
Eigen::MatrixXd sigma_points(const GaussianState& state);

/// Weights of the sigma points, which sum to one: λ / (n + λ) for the mean, 1 / (2 (n + λ)) for the others.
Eigen::VectorXd sigma_weights(Eigen::Index n);

using VectorFunction = std::function<Eigen::VectorXd(const Eigen::VectorXd&)>;

/// The state after x ← f(x) + w, w of covariance `noise` (n × n).
GaussianState unscented_prediction(const GaussianState& state, const VectorFunction& f, const Eigen::MatrixXd& noise);

/// The state after the measurement z = h(x) + v (m), v of covariance `noise` (m × m). Sigma points are those of the
/// state with the noise appended.
GaussianState unscented_update(const GaussianState& state, const VectorFunction& h, const Eigen::VectorXd& z,
                               const Eigen::MatrixXd& noise);

}  // namespace lodestone

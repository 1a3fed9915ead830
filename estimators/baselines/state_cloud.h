#pragma once

#include <functional>
#include <span>
#include <vector>

#include "core/geometry/nav_state.h"
#include "core/measurements.h"
#include "core/sensor_suite.h"

namespace lodestone {

/// The angle about the map's z axis in the rotation, rad: its twist about z.
double heading_rad(const Quaternion& R_map_imu);

/// One state of a cloud, with the logarithm of its weight.
struct WeightedState {
  NavState state;
  double log_weight = 0.0;
};

/// States whose conditional distribution is Gaussian with one common covariance: the marginalized particle filter
/// (Schön, Gustafsson and Nordlund, IEEE TSP 2005). The motion of the imu does not depend on position and heading, so
/// the covariance of each state is that of `nominal`, turned about the vertical by the difference of their headings.
class StateCloud {
 public:
  StateCloud() = default;

  /// One state, with its covariance in the order of namespace tangent.
  StateCloud(const NavState& state, const Matrix17& covariance);

  std::vector<WeightedState> states;

  const NavState& nominal() const { return nominal_; }
  /// Of each state, given what was sampled of this state. In the tangent space of the nominal state.
  const Matrix17& covariance() const { return covariance_; }

  /// A new nominal state, which should lie amid the states.
  void set_nominal(const NavState& nominal);

  /// The step of a state whose heading relative to the nominal state is that of `state`.
  Vector17 turned(const Vector17& step, const NavState& state) const;

  /// Forward propagation of all states, each with its own biases, and of the covariance.
  void propagate(std::span<const ImuSample> imu, const ImuNoise& noise);

  /// Kalman update by a measurement that depends neither on position nor on heading. `residual`: predicted minus
  /// measured or the reverse, m components at a state; `jacobian`: of the residual at the nominal state, m×17;
  /// `noise`: covariance of the residual, m×m. Weights states by the likelihood of their residuals.
  void update(const std::function<Eigen::VectorXd(const NavState&)>& residual, const Eigen::MatrixXd& jacobian,
              const Eigen::MatrixXd& noise);

  /// Weights of the states, of sum 1.
  std::vector<double> weights() const;

  /// Mean of the states with the given weights (of sum 1), in the tangent space of the nominal state.
  NavState mean(std::span<const double> weights) const;

  /// Weighted second moments of the states about `about`, in its tangent space; the covariance that they share is not
  /// included.
  Matrix17 spread(std::span<const double> weights, const NavState& about) const;

  /// Replaces the covariance of the linear functions `seen` (d×17) of the state by `posterior` (d×d), and adjusts the
  /// covariance of the rest of the state by regression. A posterior of zero: `seen` has been sampled.
  struct Regression;
  void replace_covariance(const Regression& regression, const Eigen::MatrixXd& posterior);

 private:
  NavState nominal_;
  Matrix17 covariance_ = Matrix17::Identity();
};

/// What readings of the field observe of a state, n = `seen` δ: heading (rad), x, y and, if the map has several
/// heights, z (m, map axes), and the regression of the complete state on n.
struct StateCloud::Regression {
  Eigen::MatrixXd seen;        ///< d×17
  Eigen::MatrixXd covariance;  ///< of n, d×d
  Eigen::MatrixXd root;        ///< root rootᵀ = covariance, d×d
  Eigen::MatrixXd gain;        ///< δ = gain n, 17×d

  int dimensions() const { return static_cast<int>(seen.rows()); }
};

/// The regression at the nominal state of a cloud.
StateCloud::Regression field_regression(const StateCloud& cloud, bool with_height);

}  // namespace lodestone

#pragma once

#include <Eigen/Core>

namespace lodestone {

/// What measurements tell of parameters beyond their prior, direction by direction. Directions are those of the
/// parameters in units of the prior's sigmas, in which the information of the measurements is diagonal: along direction
/// i its eigenvalue λ_i shrinks the prior's variance by 1 / (1 + λ_i); its gain is λ_i / (1 + λ_i), from 0 (nothing
/// told) to 1.
struct ParameterGain {
  Eigen::VectorXd prior_sigma;
  Eigen::MatrixXd directions;  ///< columns, orthonormal, in units of the prior
  Eigen::VectorXd gain;        ///< of each, rising
  Eigen::Index hidden = 0;     ///< the first so many lie below the threshold

  /// How much of each parameter (0 to 1) lies in the hidden directions.
  Eigen::VectorXd hidden_share() const;

  /// How much of a pattern of parameters, given in units of the prior, lies in them. `pattern` need not have unit
  /// length.
  double hidden_share_of(const Eigen::VectorXd& pattern) const;

  /// Rows that are zero where the hidden directions are at their prior, in units of its sigma: hidden × parameters.
  Eigen::MatrixXd hidden_rows() const;

  /// Of parameters whose hidden directions are held at the prior: there its variance, elsewhere prior and measurements.
  Eigen::MatrixXd covariance() const;
};

/// `information`: of the measurements alone, without the prior, symmetric. Directions of a gain below `threshold` are
/// hidden.
ParameterGain analyse_gain(const Eigen::MatrixXd& information, const Eigen::VectorXd& prior_sigma, double threshold);

}  // namespace lodestone

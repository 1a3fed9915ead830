#pragma once

#include <Eigen/Core>

namespace lodestone {

/// The information of measurements about parameters beyond their prior, by direction. Directions are eigenvectors of
/// the measurements' information, with parameters in units of the prior's sigmas. Along direction i the eigenvalue λ_i
/// shrinks the prior's variance by 1 / (1 + λ_i); the gain is λ_i / (1 + λ_i), from 0 (no information) to 1.
struct ParameterGain {
  Eigen::VectorXd prior_sigma;
  Eigen::MatrixXd directions;  ///< columns, orthonormal, in units of the prior
  Eigen::VectorXd gain;        ///< of each direction, rising
  Eigen::Index hidden = 0;     ///< number of directions with a gain below the threshold: the first ones

  /// The share of each parameter (0 to 1) that lies in the unobservable directions.
  Eigen::VectorXd hidden_share() const;

  /// The share of a pattern of parameters, given in units of the prior, that lies in the unobservable directions.
  /// `pattern` need not have unit length.
  double hidden_share_of(const Eigen::VectorXd& pattern) const;

  /// Rows that are zero if the unobservable directions are at their prior, in units of its sigma: hidden × parameters.
  Eigen::MatrixXd hidden_rows() const;

  /// Covariance of the parameters if unobservable directions are fixed at the prior: the prior's variance along these,
  /// that of prior and measurements elsewhere.
  Eigen::MatrixXd covariance() const;
};

/// `information`: of the measurements alone, without the prior, symmetric. Directions with a gain below `threshold` are
/// unobservable.
ParameterGain analyse_gain(const Eigen::MatrixXd& information, const Eigen::VectorXd& prior_sigma, double threshold);

}  // namespace lodestone

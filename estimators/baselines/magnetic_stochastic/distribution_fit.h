#pragma once

#include <Eigen/Core>
#include <functional>

#include "core/random_stream.h"

namespace lodestone {

/// A Gaussian distribution of n, d components.
struct FittedDistribution {
  Eigen::VectorXd mean;
  Eigen::MatrixXd covariance;
};

/// The distribution q that attains the lower bound of E_q[cost] + KL(q ‖ prior), with prior N(0, root rootᵀ):
/// q ∝ prior · exp(−cost), represented by its mean and covariance. These are found by iterated importance sampling:
/// each iteration draws `samples` (even) pairs of opposite points from the Gaussian of the iteration before, and moves
/// to the weighted moments. If too few samples would carry the weight, the weights are raised to a power below one.
/// `cost`: at n, called in parallel.
FittedDistribution fit_distribution(const Eigen::MatrixXd& root,
                                    const std::function<double(const Eigen::VectorXd&)>& cost, int samples,
                                    int iterations, RandomStream& random);

}  // namespace lodestone

#pragma once

#include <span>
#include <vector>

#include "factors/window_block.h"

namespace lodestone {

/// The prior that replaces some factors when some of their variables are eliminated.
struct MarginalPrior {
  std::vector<WindowBlock*> blocks;  ///< remaining variables, in the order in which the factors list them
  Eigen::MatrixXd root;              ///< A: r = A (x ⊟ current values) + offset, to first order
  Eigen::VectorXd offset;
  Eigen::MatrixXd disturbance;  ///< the factors' disturbances after elimination, one column each
};

/// Marginalizes `eliminated` out of `factors` in square-root form, linearized at the current values: pivoted QR over
/// the eliminated columns, without normal equations and without damping. Pivoting keeps the information of
/// rank-deficient variables about the others. `disturbances`: for each factor, the derivative of its residual by each
/// of some errors (rows × errors), or an empty matrix.
MarginalPrior marginalize(std::span<const WindowFactor> factors, std::span<WindowBlock* const> eliminated,
                          std::span<const Eigen::MatrixXd> disturbances = {});

}  // namespace lodestone

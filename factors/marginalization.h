#pragma once

#include <span>
#include <vector>

#include "factors/window_block.h"

namespace lodestone {

/// What is left of some factors once some of their variables are gone.
struct MarginalPrior {
  std::vector<WindowBlock*> blocks;  ///< the variables that remain, in the order in which the factors name them
  Eigen::MatrixXd root;              ///< A: r = A (x ⊟ the present values) + offset, to first order
  Eigen::VectorXd offset;
  Eigen::MatrixXd disturbance;  ///< what the factors' disturbances have become: a column each
};

/// Marginalizes `eliminated` out of `factors` in square-root form: pivoted QR over the eliminated columns, which keeps
/// what rank-deficient variables say of others; no normal equations, no ridge. All is linearized at the present values.
/// `disturbances`: for each factor, how each of some errors moves its residual (rows × errors), or an empty matrix.
MarginalPrior marginalize(std::span<const WindowFactor> factors, std::span<WindowBlock* const> eliminated,
                          std::span<const Eigen::MatrixXd> disturbances = {});

}  // namespace lodestone

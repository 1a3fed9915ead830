#pragma once

#include <span>
#include <vector>

#include "factors/window_block.h"

namespace lodestone {

/// What is left of some factors once some of their variables are gone.
struct MarginalPrior {
  std::vector<WindowBlock*> blocks;  ///< the variables that remain, in the order in which the factors name them
  Eigen::MatrixXd root;              ///< A: r = A (x ⊟ first estimate) + offset
  Eigen::VectorXd offset;
};

/// Marginalizes `eliminated` out of `factors` in square-root form: pivoted QR over the eliminated columns, which keeps
/// what rank-deficient variables say of others; no normal equations, no ridge. The remaining blocks get their first
/// estimate here, where they have none yet.
MarginalPrior marginalize(std::span<const WindowFactor> factors, std::span<WindowBlock* const> eliminated);

}  // namespace lodestone

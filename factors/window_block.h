#pragma once

#include <ceres/problem.h>

#include <vector>

#include "factors/prior_factor.h"

namespace lodestone {

/// A variable of the window. Ceres requires a fixed address of its values.
struct WindowBlock {
  BlockKind kind = BlockKind::euclidean;
  std::vector<double> values;

  int tangent_size() const { return lodestone::tangent_size(kind, static_cast<int>(values.size())); }
};

/// A factor of the window with its variables, in the factor's order.
struct WindowFactor {
  ceres::ResidualBlockId id = nullptr;
  const ceres::CostFunction* function = nullptr;
  std::vector<WindowBlock*> blocks;

  explicit operator bool() const { return id != nullptr; }
};

/// A factor whose content is replaced between solves. Ceres owns the function.
template <class Function>
struct RenewableFactor : WindowFactor {
  Function* content = nullptr;
};

/// Residual of a factor at the current values, and its Jacobian by the tangents of its blocks, side by side.
struct LinearizedFactor {
  Eigen::VectorXd residual;
  Eigen::MatrixXd jacobian;  ///< rows × sum of tangent sizes, order of WindowFactor::blocks
};

LinearizedFactor linearize(const WindowFactor& factor);

}  // namespace lodestone

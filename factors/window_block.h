#pragma once

#include <ceres/problem.h>

#include <utility>
#include <vector>

#include "factors/cached_factor.h"
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
  CachedFactor* cached = nullptr;  ///< `function`, if it keeps its evaluations

  explicit operator bool() const { return id != nullptr; }
};

/// A factor whose content is replaced between solves. Ceres owns the function.
template <class Function>
class RenewableFactor : public WindowFactor {
 public:
  RenewableFactor() = default;
  RenewableFactor(WindowFactor factor, Function* content) : WindowFactor(std::move(factor)), content_(content) {}

  const Function& content() const { return *content_; }

  /// The content, to be changed.
  Function& change() {
    cached->forget();
    return *content_;
  }

 private:
  Function* content_ = nullptr;
};

/// Residual of a factor at the current values, and its Jacobian by the tangents of its blocks, side by side.
struct LinearizedFactor {
  Eigen::VectorXd residual;
  Eigen::MatrixXd jacobian;  ///< rows × sum of tangent sizes, order of WindowFactor::blocks
};

LinearizedFactor linearize(const WindowFactor& factor);

/// Removes the columns of the blocks for which `is_kept` is false.
template <class Predicate>
void keep_columns(const std::vector<WindowBlock*>& blocks, const Predicate& is_kept, Eigen::MatrixXd& matrix) {
  Eigen::Index from = 0;
  Eigen::Index to = 0;
  for (const WindowBlock* block : blocks) {
    const Eigen::Index size = block->tangent_size();
    if (is_kept(block)) {
      if (from != to) matrix.middleCols(to, size) = matrix.middleCols(from, size).eval();
      to += size;
    }
    from += size;
  }
  matrix.conservativeResize(Eigen::NoChange, to);
}

}  // namespace lodestone

#include "factors/window_block.h"

#include "factors/manifolds.h"

namespace lodestone {

namespace {

using RowMajorMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Derivative by the tangent of a block from that by its values.
template <class Manifold, int size, int tangent_size>
void to_tangent(const Eigen::Map<const RowMajorMatrix>& by_values, const double* values,
                Eigen::Ref<Eigen::MatrixXd> by_tangent) {
  Eigen::Matrix<double, size, tangent_size, Eigen::RowMajor> plus;
  Manifold().PlusJacobian(values, plus.data());
  by_tangent = by_values.leftCols<size>().lazyProduct(plus);
}

}  // namespace

LinearizedFactor linearize(const WindowFactor& factor) {
  const int rows = factor.function->num_residuals();
  std::size_t size = 0;
  int columns = 0;
  for (const WindowBlock* block : factor.blocks) {
    size += block->values.size();
    columns += block->tangent_size();
  }
  std::vector<double> by_values(static_cast<std::size_t>(rows) * size);
  std::vector<const double*> values;
  std::vector<double*> jacobians;
  values.reserve(factor.blocks.size());
  jacobians.reserve(factor.blocks.size());
  double* next = by_values.data();
  for (const WindowBlock* block : factor.blocks) {
    values.push_back(block->values.data());
    jacobians.push_back(next);
    next += static_cast<std::size_t>(rows) * block->values.size();
  }
  LinearizedFactor result;
  result.residual.resize(rows);
  factor.function->Evaluate(values.data(), result.residual.data(), jacobians.data());
  result.jacobian.resize(rows, columns);
  int column = 0;
  for (std::size_t i = 0; i < factor.blocks.size(); ++i) {
    const WindowBlock& block = *factor.blocks[i];
    const Eigen::Map<const RowMajorMatrix> part(jacobians[i], rows, static_cast<Eigen::Index>(block.values.size()));
    auto by_tangent = result.jacobian.middleCols(column, block.tangent_size());
    if (is_linear(block.kind)) {
      by_tangent = part;
    } else if (block.kind == BlockKind::pose) {
      to_tangent<PoseManifold, 7, 6>(part, values[i], by_tangent);
    } else {
      to_tangent<GravityManifold, 3, 2>(part, values[i], by_tangent);
    }
    column += block.tangent_size();
  }
  return result;
}

}  // namespace lodestone

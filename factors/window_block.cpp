#include "factors/window_block.h"

#include "factors/manifolds.h"

namespace lodestone {

namespace {

using RowMajorMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

Eigen::MatrixXd plus_jacobian(BlockKind kind, const double* values) {
  if (kind == BlockKind::pose) {
    Eigen::Matrix<double, 7, 6, Eigen::RowMajor> jacobian;
    PoseManifold().PlusJacobian(values, jacobian.data());
    return jacobian;
  }
  Eigen::Matrix<double, 3, 2, Eigen::RowMajor> jacobian;
  GravityManifold().PlusJacobian(values, jacobian.data());
  return jacobian;
}

}  // namespace

LinearizedFactor linearize(const WindowFactor& factor) {
  const int rows = factor.function->num_residuals();
  LinearizedFactor result;
  result.residual.resize(rows);
  std::vector<const double*> values;
  std::vector<RowMajorMatrix> ambient;
  int columns = 0;
  for (const WindowBlock* block : factor.blocks) {
    values.push_back(block->values.data());
    ambient.emplace_back(rows, static_cast<Eigen::Index>(block->values.size()));
    columns += block->tangent_size();
  }
  std::vector<double*> jacobians;
  for (RowMajorMatrix& matrix : ambient) jacobians.push_back(matrix.data());
  factor.function->Evaluate(values.data(), result.residual.data(), jacobians.data());
  result.jacobian.resize(rows, columns);
  int column = 0;
  for (std::size_t i = 0; i < factor.blocks.size(); ++i) {
    const WindowBlock& block = *factor.blocks[i];
    const int size = block.tangent_size();
    if (is_linear(block.kind)) {
      result.jacobian.middleCols(column, size) = ambient[i];
    } else {
      result.jacobian.middleCols(column, size) = ambient[i] * plus_jacobian(block.kind, block.values.data());
    }
    column += size;
  }
  return result;
}

}  // namespace lodestone

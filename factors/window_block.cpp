#include "factors/window_block.h"

#include <algorithm>

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

void move(WindowBlock& block, const double* delta) {
  double* values = block.values.data();
  switch (block.kind) {
    case BlockKind::pose: {
      PoseBlock moved;
      PoseManifold().Plus(values, delta, moved.data());
      std::copy(moved.begin(), moved.end(), values);
      return;
    }
    case BlockKind::gravity: {
      Vector3 moved;
      GravityManifold().Plus(values, delta, moved.data());
      Eigen::Map<Vector3>{values} = moved;
      return;
    }
    case BlockKind::euclidean:
      for (std::size_t i = 0; i < block.values.size(); ++i) values[i] += delta[i];
  }
}

LinearizedFactor linearize(const WindowFactor& factor, bool first_estimates) {
  const int rows = factor.function->num_residuals();
  LinearizedFactor result;
  result.residual.resize(rows);
  std::vector<const double*> current;
  std::vector<const double*> where;
  std::vector<RowMajorMatrix> ambient;
  int columns = 0;
  bool differs = false;
  for (const WindowBlock* block : factor.blocks) {
    current.push_back(block->values.data());
    const bool fixed = first_estimates && !block->first_estimate.empty();
    where.push_back(fixed ? block->first_estimate.data() : block->values.data());
    differs |= fixed;
    ambient.emplace_back(rows, static_cast<Eigen::Index>(block->values.size()));
    columns += block->tangent_size();
  }
  std::vector<double*> jacobians;
  for (RowMajorMatrix& matrix : ambient) jacobians.push_back(matrix.data());
  factor.function->Evaluate(where.data(), result.residual.data(), jacobians.data());
  if (differs) factor.function->Evaluate(current.data(), result.residual.data(), nullptr);
  result.jacobian.resize(rows, columns);
  int column = 0;
  for (std::size_t i = 0; i < factor.blocks.size(); ++i) {
    const int size = factor.blocks[i]->tangent_size();
    if (factor.blocks[i]->kind == BlockKind::euclidean) {
      result.jacobian.middleCols(column, size) = ambient[i];
    } else {
      result.jacobian.middleCols(column, size) = ambient[i] * plus_jacobian(factor.blocks[i]->kind, where[i]);
    }
    column += size;
  }
  return result;
}

}  // namespace lodestone

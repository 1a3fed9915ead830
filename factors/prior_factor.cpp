#include "factors/prior_factor.h"

#include "factors/manifolds.h"

namespace lodestone {

Eigen::VectorXd PriorBlock::difference(const double* values) const {
  if (kind == BlockKind::pose) return to_pose(values).boxminus(to_pose(linearization.data()));
  if (kind == BlockKind::gravity) return s2::boxminus(Vector3(values), Vector3(linearization.data()));
  return Eigen::Map<const Eigen::VectorXd>(values, ambient_size()) -
         Eigen::Map<const Eigen::VectorXd>(linearization.data(), ambient_size());
}

PriorFactor::PriorFactor(std::vector<PriorBlock> blocks, Eigen::MatrixXd root, Eigen::VectorXd offset)
    : blocks_(std::move(blocks)), root_(std::move(root)), offset_(std::move(offset)) {
  set_num_residuals(static_cast<int>(root_.rows()));
  for (const PriorBlock& block : blocks_) mutable_parameter_block_sizes()->push_back(block.ambient_size());
}

bool PriorFactor::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  Eigen::Map<Eigen::VectorXd> residual(residuals, root_.rows());
  residual = offset_;
  Eigen::Index column = 0;
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    const PriorBlock& block = blocks_[i];
    const int size = block.tangent_size();
    const auto part = root_.middleCols(column, size);
    const Eigen::VectorXd difference = block.difference(parameters[i]);
    residual += part * difference;
    column += size;
    if (jacobians == nullptr || jacobians[i] == nullptr) continue;
    if (block.kind == BlockKind::pose) {
      Eigen::Matrix<double, Eigen::Dynamic, 6> jacobian = part;
      jacobian.leftCols<3>() = (jacobian.leftCols<3>() * so3::right_jacobian_inverse(difference.head<3>())).eval();
      to_ambient(parameters[i], jacobian, jacobians[i]);
      continue;
    }
    Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>> ambient(
        jacobians[i], root_.rows(), block.ambient_size());
    if (block.kind == BlockKind::gravity) {
      const Vector3 gravity(parameters[i]);
      // Tangent to ambient by the manifold's own inverse step, B(g)ᵀ hat(g) / |g|².
      ambient = part * s2::boxminus_jacobian(gravity, Vector3(block.linearization.data())) *
                (s2::basis(gravity).transpose() * so3::hat(gravity) / gravity.squaredNorm());
    } else {
      ambient = part;
    }
  }
  return true;
}

}  // namespace lodestone

#pragma once

#include <ceres/cost_function.h>

#include <vector>

#include <Eigen/Core>

namespace lodestone {

/// What a parameter block is, so that its difference from a linearization point can be formed.
enum class BlockKind { pose, gravity, euclidean };

constexpr int tangent_size(BlockKind kind, int ambient_size) {
  return kind == BlockKind::pose ? 6 : kind == BlockKind::gravity ? 2 : ambient_size;
}

/// One block of a square-root prior: where it was linearized, once and for all (first-estimate Jacobians).
struct PriorBlock {
  BlockKind kind = BlockKind::euclidean;
  std::vector<double> linearization;  ///< ambient values

  int ambient_size() const { return static_cast<int>(linearization.size()); }
  int tangent_size() const { return lodestone::tangent_size(kind, ambient_size()); }

  /// x ⊟ linearization point.
  Eigen::VectorXd difference(const double* values) const;
};

/// What marginalized factors know of the blocks they touched: r = A (x ⊟ x_lin) + r₀, in square-root form.
class PriorFactor final : public ceres::CostFunction {
 public:
  /// `root`: rows × (sum of tangent sizes, in the order of `blocks`); `offset`: r₀.
  PriorFactor(std::vector<PriorBlock> blocks, Eigen::MatrixXd root, Eigen::VectorXd offset);

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

  const std::vector<PriorBlock>& blocks() const { return blocks_; }
  const Eigen::MatrixXd& root() const { return root_; }
  const Eigen::VectorXd& offset() const { return offset_; }

 private:
  std::vector<PriorBlock> blocks_;
  Eigen::MatrixXd root_;
  Eigen::VectorXd offset_;
};

}  // namespace lodestone

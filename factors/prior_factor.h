#pragma once

#include <ceres/cost_function.h>

#include <vector>

#include "core/geometry/slide.h"

namespace lodestone {

/// What a parameter block is, so that its difference from a linearization point can be formed. A motion is v, b_g, b_a.
enum class BlockKind { pose, motion, gravity, euclidean };

constexpr int tangent_size(BlockKind kind, int ambient_size) {
  return kind == BlockKind::pose ? 6 : kind == BlockKind::gravity ? 2 : ambient_size;
}

/// Whether its tangent is its difference.
constexpr bool is_linear(BlockKind kind) {
  return kind == BlockKind::motion || kind == BlockKind::euclidean;
}

/// One block of a square-root prior: where it was linearized, once and for all.
struct PriorBlock {
  BlockKind kind = BlockKind::euclidean;
  std::vector<double> linearization;  ///< ambient values

  int ambient_size() const { return static_cast<int>(linearization.size()); }
  int tangent_size() const { return lodestone::tangent_size(kind, ambient_size()); }
};

/// What marginalized factors know of the blocks they touched: r = A (x ⊟ x_lin) + r₀, in square-root form. Where a
/// slide is given, ⊟ of a pose, and of the velocity of the motion that follows it, have it straightened
/// (difference_along): what was free when the prior was made stays free however far the states slide.
class PriorFactor final : public ceres::CostFunction {
 public:
  /// `root`: A by Ceres' tangents at the linearization points, rows × (sum of tangent sizes, in the order of `blocks`);
  /// `offset`: r₀. `slide`: of the poses, about the place of any; none: ⊟ of the tangent.
  PriorFactor(std::vector<PriorBlock> blocks, Eigen::MatrixXd root, Eigen::VectorXd offset, const Slide& slide = {});

  /// Lets the states slide another way, a little off: what was known of the old slide is known of the new one, and the
  /// rest as before. Else what was free one way would be held in the other by what is known across it. Where nothing
  /// slid before, or more than 0.2 rad away, what is known along the new way stays.
  void follow(const Slide& slide);

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

  const std::vector<PriorBlock>& blocks() const { return blocks_; }
  const Eigen::MatrixXd& root() const { return root_; }
  const Eigen::VectorXd& offset() const { return offset_; }
  const Slide& slide() const { return slide_; }

 private:
  bool follows_pose(std::size_t block) const;

  std::vector<PriorBlock> blocks_;
  Eigen::MatrixXd root_;
  Eigen::VectorXd offset_;
  Slide slide_;
};

}  // namespace lodestone

#pragma once

#include <ceres/cost_function.h>

#include <vector>

#include "core/geometry/slide.h"

namespace lodestone {

/// Kind of a parameter block, which determines its difference from a linearization point. A motion is v, b_g, b_a.
enum class BlockKind { pose, motion, gravity, euclidean };

constexpr int tangent_size(BlockKind kind, int ambient_size) {
  return kind == BlockKind::pose ? 6 : kind == BlockKind::gravity ? 2 : ambient_size;
}

/// Whether the tangent vector is the difference of the values.
constexpr bool is_linear(BlockKind kind) {
  return kind == BlockKind::motion || kind == BlockKind::euclidean;
}

/// One block of a square-root prior with its fixed linearization point.
struct PriorBlock {
  BlockKind kind = BlockKind::euclidean;
  std::vector<double> linearization;  ///< ambient values

  int ambient_size() const { return static_cast<int>(linearization.size()); }
  int tangent_size() const { return lodestone::tangent_size(kind, ambient_size()); }
};

/// The prior from marginalized factors: r = A (x ⊟ x_lin) + r₀, in square-root form. With a slide, ⊟ of a pose, and of
/// the velocity in the following motion, straightens the slide (difference_along): a direction that was unobservable
/// when the prior was made stays so however far the states slide (docs/design/010-unobservable-rigid-motion.md).
class PriorFactor final : public ceres::CostFunction {
 public:
  /// `root`: A in Ceres' tangents at the linearization points, rows × (sum of tangent sizes, in the order of `blocks`);
  /// `offset`: r₀. `slide`: of the poses; the reference place is arbitrary; empty: ⊟ of the tangent.
  PriorFactor(std::vector<PriorBlock> blocks, Eigen::MatrixXd root, Eigen::VectorXd offset, const Slide& slide = {});

  /// Replaces the slide by a slightly different one. The information about the old slide becomes information about the
  /// new one, and the rest is unchanged; otherwise information across the new slide would constrain it. If there was no
  /// slide before, or one more than 0.2 rad away, the information along the new slide stays.
  void follow(const Slide& slide);

  /// Moves the linearization points of poses and velocities: states that are moved likewise have the same residuals.
  void move(const Pose& T_new_old);

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

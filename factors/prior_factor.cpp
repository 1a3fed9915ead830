#include "factors/prior_factor.h"

#include <cmath>

#include "factors/manifolds.h"

namespace lodestone {

namespace {

using RowMajorMap = Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>;

SlideDifference pose_difference(const Slide& slide, const double* values, const PriorBlock& block) {
  const Pose then = to_pose(block.linearization.data());
  return difference_along(slide.about(then.position), to_pose(values), then);
}

}  // namespace

PriorFactor::PriorFactor(std::vector<PriorBlock> blocks, Eigen::MatrixXd root, Eigen::VectorXd offset,
                         const Slide& slide)
    : blocks_(std::move(blocks)), root_(std::move(root)), offset_(std::move(offset)), slide_(slide) {
  set_num_residuals(static_cast<int>(root_.rows()));
  for (const PriorBlock& block : blocks_) mutable_parameter_block_sizes()->push_back(block.ambient_size());
}

bool PriorFactor::follows_pose(std::size_t block) const {
  return slide_.any() && blocks_[block].kind == BlockKind::motion && block > 0 &&
         blocks_[block - 1].kind == BlockKind::pose;
}

void PriorFactor::follow(const Slide& slide) {
  constexpr double kSameWay = 0.98;  // cosine
  Eigen::Index column = 0;
  for (std::size_t i = 0; i < blocks_.size(); column += blocks_[i].tangent_size(), ++i) {
    if (blocks_[i].kind != BlockKind::pose || !slide_.any() || !slide.any()) continue;
    const Pose pose = to_pose(blocks_[i].linearization.data());
    const Slide before = slide_.about(pose.position);
    const Slide now = slide.about(pose.position);
    const double same = before.direction.dot(now.direction);
    if (std::abs(same) < kSameWay) continue;
    // Old minus new; the sign of a slide is arbitrary.
    const double sign = same < 0.0 ? -1.0 : 1.0;
    const Vector3 turn = sign * before.turn - now.turn;
    Eigen::VectorXd moved = root_.middleCols<3>(column) * (pose.rotation.conjugate() * turn) +
                            root_.middleCols<3>(column + 3) * (sign * before.direction - now.direction);
    if (i + 1 < blocks_.size() && follows_pose(i + 1)) {
      moved += root_.middleCols<3>(column + 6) * turn.cross(Vector3(blocks_[i + 1].linearization.data()));
    }
    root_.middleCols<3>(column + 3) += moved * now.direction.transpose();
  }
  slide_ = slide;
}

void PriorFactor::move(const Pose& T_new_old) {
  const Matrix3 back = T_new_old.rotation.conjugate().toRotationMatrix();
  Eigen::Index column = 0;
  for (PriorBlock& block : blocks_) {
    double* values = block.linearization.data();
    if (block.kind == BlockKind::pose) {
      from_pose(T_new_old * to_pose(values), values);
      root_.middleCols<3>(column + 3) *= back;
    } else if (block.kind == BlockKind::motion) {
      Eigen::Map<Vector3> velocity(values);
      velocity = (T_new_old.rotation * velocity).eval();
      root_.middleCols<3>(column) *= back;
    }
    column += block.tangent_size();
  }
  slide_.at = T_new_old * slide_.at;
  slide_.direction = (T_new_old.rotation * slide_.direction).eval();
  slide_.turn = (T_new_old.rotation * slide_.turn).eval();
}

bool PriorFactor::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  Eigen::Map<Eigen::VectorXd> residual(residuals, root_.rows());
  residual = offset_;
  Eigen::Index column = 0;
  SlideDifference pose;  // of the last pose block
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    const PriorBlock& block = blocks_[i];
    const double* values = parameters[i];
    const auto part = root_.middleCols(column, block.tangent_size());
    column += block.tangent_size();
    double* ambient = jacobians == nullptr ? nullptr : jacobians[i];
    if (block.kind == BlockKind::pose) {
      pose = pose_difference(slide_, values, block);
      residual += part * pose.value;
      if (ambient == nullptr) continue;
      Eigen::Matrix<double, Eigen::Dynamic, 6> jacobian = part * pose.by_tangent;
      if (i + 1 < blocks_.size() && follows_pose(i + 1)) {
        const Vector3 turn = slide_.about(to_pose(block.linearization.data()).position).turn;
        const Vector3 velocity = pose.unslid.back * Vector3(parameters[i + 1]);
        const Vector3 then(blocks_[i + 1].linearization.data());
        jacobian.rightCols<3>() +=
            root_.middleCols<3>(column) * turn.cross(then - velocity) * pose.unslid.by_position.transpose();
      }
      to_ambient(values, jacobian, ambient);
    } else if (block.kind == BlockKind::gravity) {
      const Vector3 gravity(values);
      const Vector3 then(block.linearization.data());
      residual += part * s2::boxminus(gravity, then);
      if (ambient == nullptr) continue;
      // From tangent to ambient by the inverse of the manifold's own step, B(g)ᵀ hat(g) / |g|².
      RowMajorMap(ambient, root_.rows(), 3) =
          part * s2::boxminus_jacobian(gravity, then) *
          (s2::basis(gravity).transpose() * so3::hat(gravity) / gravity.squaredNorm());
    } else {
      const int size = block.ambient_size();
      const Eigen::Map<const Eigen::VectorXd> then(block.linearization.data(), size);
      Eigen::VectorXd difference = Eigen::Map<const Eigen::VectorXd>(values, size) - then;
      const bool slides = follows_pose(i);
      if (slides) {
        const Vector3 turn = slide_.about(to_pose(blocks_[i - 1].linearization.data()).position).turn;
        difference.head<3>() = pose.unslid.back * Vector3(values) - then.head<3>() +
                               pose.unslid.distance_m * turn.cross(Vector3(then.head<3>()));
      }
      residual += part * difference;
      if (ambient == nullptr) continue;
      RowMajorMap by_values(ambient, root_.rows(), size);
      by_values = part;
      if (slides) by_values.leftCols(3) = part.leftCols(3) * pose.unslid.back.toRotationMatrix();
    }
  }
  return true;
}

}  // namespace lodestone

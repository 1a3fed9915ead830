#include "factors/point_plane_factor.h"

#include <cmath>

#include "factors/manifolds.h"

namespace lodestone {

PointPlaneFactor::PointPlaneFactor(std::vector<Correspondence> correspondences, const PoseMask& mask)
    : correspondences_(std::move(correspondences)), mask_(mask) {
  set_num_residuals(static_cast<int>(correspondences_.size()));
  mutable_parameter_block_sizes()->push_back(7);
}

bool PointPlaneFactor::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  const bool derive = jacobians != nullptr && jacobians[0] != nullptr;
  Matrix6 seen_by_pose;
  const Pose seen = mask_.apply(to_pose(parameters[0]), derive ? &seen_by_pose : nullptr);
  const Matrix3 rotation = seen.rotation.toRotationMatrix();
  for (std::size_t i = 0; i < correspondences_.size(); ++i) {
    const Correspondence& match = correspondences_[i];
    const Vector3 normal = match.plane->normal.cast<double>();
    const Vector3 point = match.point.cast<double>();
    const double root_weight = std::sqrt(static_cast<double>(match.weight()));
    residuals[i] = root_weight * normal.dot(rotation * point + seen.position - match.plane->center.cast<double>());
    if (derive) {
      Eigen::Matrix<double, 1, 6> jacobian;
      jacobian.head<3>() = root_weight * point.cross(rotation.transpose() * normal).transpose();
      jacobian.tail<3>() = root_weight * normal.transpose();
      to_ambient(parameters[0], jacobian * seen_by_pose, jacobians[0] + 7 * i);
    }
  }
  return true;
}

}  // namespace lodestone

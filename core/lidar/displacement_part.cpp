#include "core/lidar/displacement_part.h"

#include "core/geometry/so3.h"

namespace lodestone {

DisplacementPart::DisplacementPart(int part, const Vector3& position) : part_(part), position_(position) {
  const double length_m = map_error_length_m(part);
  if (part >= kFirstPartOfPlaces) place_ << Vector3::Constant(0.5 / (length_m * length_m)), Vector3::Ones();
}

DisplacementPart::Motion DisplacementPart::motion(const DisplacedAxis& axis) const {
  if (part_ < kFirstPartOfPlaces) return {Vector6::Zero(), Vector6::Zero()};
  const Vector3 arm = axis.place - position_;
  Vector6 moved;
  moved << arm.cross(axis.axis), axis.axis;
  return {moved, (0.5 - map_error_correlation(arm.squaredNorm(), part_)) * place_.cwiseProduct(moved)};
}

double DisplacementPart::variance(const DisplacedAxis& axis) const {
  const Motion own = motion(axis);
  return 1.0 + 2.0 * own.moved.dot(own.rest);
}

Eigen::MatrixXd DisplacementPart::covariance(const std::vector<DisplacedAxis>& axes) const {
  const auto count = static_cast<Eigen::Index>(axes.size());
  Eigen::MatrixXd moved(6, count);
  Eigen::MatrixXd rest(6, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Motion own = motion(axes[static_cast<std::size_t>(i)]);
    moved.col(i) = own.moved;
    rest.col(i) = own.rest;
  }
  const Eigen::MatrixXd crossed = moved.transpose() * rest;
  Eigen::MatrixXd result = crossed + crossed.transpose();
  for (Eigen::Index i = 0; i < count; ++i) {
    const DisplacedAxis& here = axes[static_cast<std::size_t>(i)];
    for (Eigen::Index k = 0; k <= i; ++k) {
      const DisplacedAxis& there = axes[static_cast<std::size_t>(k)];
      const double along = here.axis.dot(there.axis);
      if (along == 0.0) continue;
      const double covariance = along * map_error_correlation((here.place - there.place).squaredNorm(), part_);
      result(i, k) += covariance;
      if (i != k) result(k, i) += covariance;
    }
  }
  return result;
}

Matrix6 DisplacementPart::covariance_of_pose(const std::vector<DisplacedPlace>& places) const {
  Matrix6 pairs = Matrix6::Zero();
  Matrix6 with_place = Matrix6::Zero();  // of what the displacements make of the pose, with S
  Matrix6 rigid = Matrix6::Zero();       // what a motion of everything makes of it
  for (std::size_t i = 0; i < places.size(); ++i) {
    const DisplacedPlace& here = places[i];
    Matrix6x3 sum = 0.5 * here.moved;  // each pair once
    for (std::size_t k = 0; k < i; ++k) {
      const double correlation = map_error_correlation((here.center - places[k].center).squaredNorm(), part_);
      if (correlation > 0.0) sum += correlation * places[k].moved;
    }
    pairs.noalias() += here.moved * sum.transpose();
    pairs += 0.5 * share_apart(here.spread_m2) * here.apart;
    if (part_ < kFirstPartOfPlaces) continue;
    const Vector3 arm = here.center - position_;
    Matrix6x3 moving;
    moving << so3::hat(arm), Matrix3::Identity();
    const Matrix6 moved = here.moved * moving.transpose();
    rigid += moved;
    with_place += map_error_correlation(arm.squaredNorm(), part_) * moved;
  }
  const Matrix6 half = (0.5 * rigid - with_place) * place_.asDiagonal() * rigid.transpose();
  return pairs + pairs.transpose() + half + half.transpose();
}

}  // namespace lodestone

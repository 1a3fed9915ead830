#include "core/evaluation/alignment.h"

#include <Eigen/SVD>
#include <limits>
#include <stdexcept>

namespace lodestone {

std::optional<Similarity> umeyama(const std::vector<Vector3>& from, const std::vector<Vector3>& to, bool with_scale) {
  if (from.size() != to.size()) throw std::invalid_argument("umeyama: both sets must have the same number of points");
  if (from.empty()) return std::nullopt;
  const double count = static_cast<double>(from.size());
  Vector3 mean_from = Vector3::Zero();
  Vector3 mean_to = Vector3::Zero();
  for (std::size_t i = 0; i < from.size(); ++i) {
    mean_from += from[i];
    mean_to += to[i];
  }
  mean_from /= count;
  mean_to /= count;

  double variance = 0.0;
  Matrix3 covariance = Matrix3::Zero();
  for (std::size_t i = 0; i < from.size(); ++i) {
    variance += (from[i] - mean_from).squaredNorm();
    covariance += (to[i] - mean_to) * (from[i] - mean_from).transpose();
  }
  variance /= count;
  covariance /= count;

  const Eigen::JacobiSVD<Matrix3> svd(covariance, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Vector3 singular = svd.singularValues();
  // The threshold is relative. Otherwise rounding of collinear points far from the origin counts as a second direction.
  if (singular(1) <= std::max(std::numeric_limits<double>::epsilon(), 1e-12 * singular(0))) return std::nullopt;
  Vector3 sign = Vector3::Ones();
  if (svd.matrixU().determinant() * svd.matrixV().determinant() < 0.0) sign(2) = -1.0;

  Similarity result;
  const Matrix3 rotation = svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose();
  result.rotation = Quaternion(rotation).normalized();
  result.scale = with_scale ? singular.dot(sign) / variance : 1.0;
  result.translation = mean_to - result.scale * (rotation * mean_from);
  return result;
}

std::optional<Similarity> find_alignment(const PosePairs& pairs, Alignment alignment) {
  if (pairs.empty()) return std::nullopt;
  if (alignment == Alignment::none) return Similarity{};
  if (alignment == Alignment::origin) {
    const Pose to_truth = pairs.front().truth * pairs.front().estimate.inverse();
    return Similarity{to_truth.rotation, to_truth.position, 1.0};
  }
  std::vector<Vector3> from;
  std::vector<Vector3> to;
  for (const PosePair& pair : pairs) {
    from.push_back(pair.estimate.position);
    to.push_back(pair.truth.position);
  }
  return umeyama(from, to, alignment == Alignment::sim3);
}

PosePairs align(const Similarity& similarity, PosePairs pairs) {
  for (PosePair& pair : pairs) pair.estimate = similarity * pair.estimate;
  return pairs;
}

}  // namespace lodestone

#include "core/lidar/plane_fit.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace lodestone {

namespace {

/// Thickness over in-plane spread of a flat set of points, at most. A right angle of two equal surfaces has 0.71, a
/// volume 1.
constexpr double kFlatRatio = 0.6;

}  // namespace

bool fit_plane(const PointMoments& moments, const Vector3& reference, const PlaneFitOptions& options, Plane& plane) {
  if (moments.count < std::max(options.min_points, 4)) return false;
  const double count = static_cast<double>(moments.count);
  const Vector3 mean = moments.sum / count;
  const Matrix3 covariance = moments.outer / count - mean * mean.transpose();
  const Eigen::SelfAdjointEigenSolver<Matrix3> solver(covariance);
  const Vector3 variance = solver.eigenvalues().cwiseMax(0.0);  // increasing
  const double thickness = std::sqrt(variance[0]);
  const double minor_spread = std::sqrt(variance[1]);
  if (minor_spread < options.min_spread_m || thickness > kFlatRatio * minor_spread) return false;
  // Three parameters were fitted: the unbiased residual variance has count − 3 degrees of freedom.
  const double residual_variance = variance[0] * count / (count - 3.0);
  plane.normal = solver.eigenvectors().col(0).cast<float>().normalized();
  plane.major = solver.eigenvectors().col(2).cast<float>().normalized();
  plane.center = (reference + mean).cast<float>();
  plane.offset_variance = static_cast<float>(residual_variance / count);
  plane.major_tilt_variance = static_cast<float>(residual_variance / (count * variance[2]));
  plane.minor_tilt_variance = static_cast<float>(residual_variance / (count * variance[1]));
  plane.thickness = static_cast<float>(thickness);
  plane.count = static_cast<std::int32_t>(moments.count);
  return true;
}

bool within_limits(const Plane& plane, const PlaneFitOptions& options) {
  if (static_cast<double>(plane.thickness) > options.max_thickness_m) return false;
  // The slope's variance is the residuals' over count times the spread squared.
  const double own = static_cast<double>(plane.count) - 3.0;
  return own * static_cast<double>(plane.minor_tilt_variance) <= std::pow(options.max_thickness_ratio, 2);
}

}  // namespace lodestone

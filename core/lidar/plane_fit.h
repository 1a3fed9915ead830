#pragma once

#include <cstdint>

#include "core/geometry/so3.h"
#include "core/option_checks.h"

namespace lodestone {

/// Sums over points for a plane fit, relative to a fixed reference so that no digits are lost.
struct PointMoments {
  std::int64_t count = 0;
  Vector3 sum = Vector3::Zero();
  Matrix3 outer = Matrix3::Zero();  ///< Σ x xᵀ

  void add(const Vector3& point) {
    ++count;
    sum += point;
    outer += point * point.transpose();
  }
};

/// A plane with the variance of its own fit. Floats: it is stored by the million.
struct Plane {
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();  ///< unit, map axes
  Eigen::Vector3f center = Eigen::Vector3f::Zero();  ///< centroid of its points, map, metres
  Eigen::Vector3f major =
      Eigen::Vector3f::Zero();   ///< unit, in the plane: direction of largest spread; the third axis is normal × major
  float offset_variance = 0.0F;  ///< m²: variance of the plane's height at its centre
  float major_tilt_variance = 0.0F;  ///< rad²: variance of the slope along `major`
  float minor_tilt_variance = 0.0F;  ///< rad²: variance of the slope along normal × major
  float thickness = 0.0F;            ///< m: rms distance of its points from it
  std::int32_t count = 0;            ///< points it was fitted to

  /// Signed distance of a map point, metres.
  float distance(const Eigen::Vector3f& point) const { return normal.dot(point - center); }

  /// Variance of the plane's height under `point`, m²: that of the offset and of both slopes times their levers.
  float variance_at(const Eigen::Vector3f& point) const {
    const Eigen::Vector3f lever = point - center;
    const float along_major = major.dot(lever);
    const float along_minor = normal.cross(major).dot(lever);
    return offset_variance + major_tilt_variance * along_major * along_major +
           minor_tilt_variance * along_minor * along_minor;
  }
};

/// When a set of points counts as a plane.
struct PlaneFitOptions {
  int min_points = 6;
  double max_thickness_m = 0.03;     ///< rms distance from the plane
  double max_thickness_ratio = 0.3;  ///< thickness over the smaller in-plane spread
  double min_spread_m = 0.04;        ///< the smaller in-plane spread (one sigma): a line is no plane

  template <class Visitor>
  void visit(Visitor& visitor) {
    visitor.field("min_points", min_points, "fewest points of a plane");
    visitor.field("max_thickness_m", max_thickness_m,
                  "largest rms distance of a plane's points from it; larger in a map whose own noise is larger");
    visitor.field(
        "max_thickness_ratio", max_thickness_ratio,
        "thickness over the smaller in-plane spread; a plane no thicker than the map's own noise may exceed it");
    visitor.field("min_spread_m", min_spread_m, "smallest in-plane spread, one sigma");
  }

  void check() const {
    option_checks::within("min_points", min_points, 4, 1000000);
    option_checks::positive("max_thickness_m", max_thickness_m);
    option_checks::positive("max_thickness_ratio", max_thickness_ratio);
    option_checks::not_negative("min_spread_m", min_spread_m);
  }
};

/// Fits a plane by principal components. False if the points are few, in a line or not flat at all. The limits of
/// thickness are not applied. `reference`: the reference of the moments (map, metres).
bool fit_plane(const PointMoments& moments, const Vector3& reference, const PlaneFitOptions& options, Plane& plane);

/// Whether a plane of fit_plane() has neither limit of thickness exceeded.
bool within_limits(const Plane& plane, const PlaneFitOptions& options);

}  // namespace lodestone

#include "core/observability/information_noise.h"

#include <unordered_map>
#include <vector>

namespace lodestone {
namespace {

/// Sums over the points of one plane, one element per direction.
struct PlaneSums {
  const Plane* plane;
  Vector6 seen_major = Vector6::Zero();  ///< Σ w h α
  Vector6 seen_minor = Vector6::Zero();  ///< Σ w h β
  Vector6 major = Vector6::Zero();       ///< Σ w α²
  Vector6 minor = Vector6::Zero();       ///< Σ w β²
  Vector6 both = Vector6::Zero();        ///< Σ w α β
};

}  // namespace

InformationNoise information_noise(std::span<const Correspondence> correspondences, const Pose& T_map_imu,
                                   const Matrix6& directions) {
  // Planes in order of appearance: no sum depends on addresses.
  std::vector<PlaneSums> planes;
  std::unordered_map<const Plane*, std::size_t> index_of;
  const Matrix3 rotation = T_map_imu.rotation.toRotationMatrix();
  for (const Correspondence& match : correspondences) {
    const auto [found, added] = index_of.try_emplace(match.plane, planes.size());
    if (added) planes.push_back({match.plane});
    PlaneSums& sums = planes[found->second];
    // J u = nᵀ f: f is how the point moves in the map when the pose moves by u.
    const Eigen::Matrix<double, 3, 6> motions =
        directions.bottomRows<3>() - rotation * so3::hat(match.point.cast<double>()) * directions.topRows<3>();
    const Vector3 normal = match.plane->normal.cast<double>();
    const Vector3 major_axis = match.plane->major.cast<double>();
    const Vector6 seen = motions.transpose() * normal;
    const Vector6 alpha = motions.transpose() * major_axis;
    const Vector6 beta = motions.transpose() * normal.cross(major_axis);
    const double weight = static_cast<double>(match.weight());
    sums.seen_major += weight * seen.cwiseProduct(alpha);
    sums.seen_minor += weight * seen.cwiseProduct(beta);
    sums.major += weight * alpha.cwiseAbs2();
    sums.minor += weight * beta.cwiseAbs2();
    sums.both += weight * alpha.cwiseProduct(beta);
  }

  InformationNoise noise;
  Vector6 mixed =
      Vector6::Zero();  // 4 Var(a Σ w h α + b Σ w h β), with the measured h, which contains the errors as well
  Vector6 pure = Vector6::Zero();  // variance of Σ w (α a + β b)²
  for (const PlaneSums& sums : planes) {
    const double major = sums.plane->major_tilt_variance;
    const double minor = sums.plane->minor_tilt_variance;
    noise.mean += major * sums.major + minor * sums.minor;
    mixed += 4.0 * (major * sums.seen_major.cwiseAbs2() + minor * sums.seen_minor.cwiseAbs2());
    pure += 2.0 * (major * sums.major).cwiseAbs2() + 2.0 * (minor * sums.minor).cwiseAbs2() +
            4.0 * major * minor * sums.both.cwiseAbs2();
  }
  // On average the errors add twice the pure variance to the mixed one.
  noise.variance = pure + (mixed - 2.0 * pure).cwiseMax(0.0);
  return noise;
}

}  // namespace lodestone

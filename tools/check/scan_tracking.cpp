#include "tools/check/scan_tracking.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <array>

#include "core/angles.h"
#include "core/lidar/association.h"
#include "core/lidar/condensed_cost.h"

namespace lodestone {
namespace {

/// Always uses all points: the nearest points of a coarse search are on too few planes to determine the heading.
struct TrackingRound {
  double sigma_m;  // sigma of the pose error, for the gate of residuals
  double sigma_rad;
  int iterations;
};
constexpr std::array<TrackingRound, 2> tracking_rounds{{{0.15, 1.5 * degree, 5}, {0.03, 0.15 * degree, 5}}};
constexpr double least_share_of_best = 0.01;
constexpr double fixed_information = 1e9;  // 1/m²: no motion along this direction
constexpr double converged_m = 1e-3;
constexpr double converged_rad = 1e-4;

Matrix6 information_of(double sigma_rad, double sigma_m) {
  Vector6 variance;
  variance << Vector3::Constant(sigma_rad * sigma_rad), Vector3::Constant(sigma_m * sigma_m);
  return variance.cwiseInverse().asDiagonal();
}

/// Prior information along degenerate translations of `seen` (order φ, p), with the rotation free within `prior`.
Matrix3 constrain_degenerate(const Matrix6& seen, const Matrix6& prior) {
  const Matrix3 rotation = seen.topLeftCorner<3, 3>() + prior.topLeftCorner<3, 3>();
  const Matrix3 coupling = seen.topRightCorner<3, 3>();
  const Eigen::SelfAdjointEigenSolver<Matrix3> solver(seen.bottomRightCorner<3, 3>() -
                                                      coupling.transpose() * rotation.ldlt().solve(coupling));
  Matrix3 result = Matrix3::Zero();
  for (int i = 0; i < 3; ++i) {
    if (solver.eigenvalues()[i] >= least_share_of_best * solver.eigenvalues()[2]) continue;
    const Vector3 direction = solver.eigenvectors().col(i);
    result += fixed_information * direction * direction.transpose();
  }
  return result;
}

}  // namespace

TrackedScan track_scan(std::span<const Eigen::Vector3f> points, const Pose& predicted, const PredictionSigmas& sigmas,
                       const PlaneMap& map, const LidarModel& lidar) {
  TrackedScan tracked{predicted};
  Pose& pose = tracked.pose;
  for (const TrackingRound& round : tracking_rounds) {
    const Matrix6 gate = information_of(round.sigma_rad, round.sigma_m).inverse();
    for (int i = 0; i < round.iterations; ++i) {
      const CondensedCost cost = condense(associate(points, pose, gate, map, lidar, AssociationOptions{}), pose);
      const Matrix6 seen = cost.hessian(pose);
      Matrix6 prior = information_of(sigmas.sigma_rad, sigmas.sigma_m);
      const Matrix3 constraint = constrain_degenerate(seen, prior);
      tracked.is_degenerate = !constraint.isZero();
      prior.bottomRightCorner<3, 3>() += constraint;
      const Vector6 gradient = cost.gradient(pose) + prior * pose.boxminus(predicted);
      const Vector6 step = -(seen + prior).ldlt().solve(gradient);
      if (!step.allFinite()) return tracked;
      pose = pose.boxplus(step);
      if (step.tail<3>().norm() < converged_m && step.head<3>().norm() < converged_rad) break;
    }
  }
  return tracked;
}

}  // namespace lodestone

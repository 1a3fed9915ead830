#include "estimators/initialization/scan_registration.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/angles.h"
#include "core/lidar/condensed_cost.h"
#include "core/lidar/places_in_map.h"
#include "core/log_mixture.h"

namespace lodestone {

namespace {

/// Near points first: they remain close to their planes while the heading is inaccurate.
struct Stage {
  double range_m;
  double sigma_m;  ///< assumed error of the pose, for the gate of residuals
  double sigma_rad;
  int iterations;
};
constexpr std::array<Stage, 3> kStages{{{12.0, 0.15, 1.5 * degree, 5},
                                        {25.0, 0.06, 0.5 * degree, 4},
                                        {std::numeric_limits<double>::infinity(), 0.03, 0.15 * degree, 4}}};
constexpr double kChanceShare = 2.0 / 3.0;  // of a scan's points that fit at the best wrong place
constexpr double kConverged_m = 1e-3;
constexpr double kConverged_rad = 1e-4;

Matrix6 trust_in_start() {
  Vector6 sigma;
  sigma << 2.0 * degree, 2.0 * degree, 3.0 * degree, 0.3, 0.3, 0.2;
  return sigma.cwiseAbs2().cwiseInverse().asDiagonal();
}

}  // namespace

RegisteredScan register_scan(std::span<const Eigen::Vector3f> points, const Pose& start, const PlaneMap& map,
                             const ScanLidars& lidars, const AssociationOptions& options) {
  const Matrix6 trust = trust_in_start();
  RegisteredScan result;
  result.T_map_imu = start;
  std::vector<Eigen::Vector3f> near;
  ScanLidars near_lidars = lidars;
  for (const Stage& stage : kStages) {
    near.clear();
    near_lidars.of_points.clear();
    const auto limit = static_cast<float>(std::min(stage.range_m * stage.range_m, 1e30));
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (!(points[i].squaredNorm() < limit)) continue;
      near.push_back(points[i]);
      if (!lidars.of_points.empty()) near_lidars.of_points.push_back(lidars.of_points[i]);
    }
    Vector6 variance;
    variance << Vector3::Constant(stage.sigma_rad * stage.sigma_rad), Vector3::Constant(stage.sigma_m * stage.sigma_m);
    for (int i = 0; i < stage.iterations; ++i) {
      const std::vector<Correspondence> matches =
          associate(near, result.T_map_imu, variance.asDiagonal(), map, near_lidars, options);
      const CondensedCost cost = condense(matches, result.T_map_imu);
      result.information = cost.hessian(result.T_map_imu);
      const Vector6 gradient = cost.gradient(result.T_map_imu) + trust * result.T_map_imu.boxminus(start);
      const Vector6 step = -(result.information + trust).ldlt().solve(gradient);
      if (!step.allFinite()) return result;
      result.T_map_imu = result.T_map_imu.boxplus(step);
      if (step.tail<3>().norm() < kConverged_m && step.head<3>().norm() < kConverged_rad) break;
    }
  }
  return result;
}

double independent_points(std::size_t points) {
  return std::min(kIndependentPoints, 0.2 * static_cast<double>(points));
}

double scan_log_likelihood_off_map(std::size_t points) {
  return -independent_points(points) * (1.0 - kChanceShare) * ScanAgreement::most;
}

double scan_log_likelihood(std::size_t points, double cost) {
  return log_mixture(kUnmappedShare, -independent_points(points) * cost, scan_log_likelihood_off_map(points));
}

ScanAgreement agreement(std::span<const Eigen::Vector3f> points, const Pose& T_map_imu, const PlaneMap& map) {
  ScanAgreement result;
  result.points = static_cast<int>(points.size());
  if (points.empty()) return result;
  constexpr float kReach_m = 0.3F;
  const std::vector<Eigen::Vector3f> places = places_in_map(points, T_map_imu);
  std::vector<const Plane*> planes(places.size());
  map.match(places, kReach_m, planes);
  double sum = 0.0;
  double saved = 0.0;  // by clutter
  int within = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Plane* plane = planes[i];
    const Eigen::Vector3f& place = places[i];
    const double sigma_m = 0.05 + 0.003 * static_cast<double>(points[i].norm());
    double cost = ScanAgreement::most;
    if (plane != nullptr) {
      cost = std::min(cost, 0.5 * std::pow(static_cast<double>(plane->distance(place)) / sigma_m, 2));
      within += cost < ScanAgreement::most ? 1 : 0;
    } else if (map.agrees(place, kReach_m)) {
      const double uniform = std::log(map.voxel_m() / (std::sqrt(2.0 * std::numbers::pi) * sigma_m));
      saved += cost - std::clamp(uniform, 0.0, cost);
    }
    sum += cost;
  }
  result.cost = sum / static_cast<double>(points.size());
  result.clutter_cost = (sum - saved) / static_cast<double>(points.size());
  result.share = static_cast<double>(within) / static_cast<double>(points.size());
  return result;
}

}  // namespace lodestone

#include "estimators/initialization/start_search.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/angles.h"
#include "core/error.h"
#include "core/geometry/pose_distance.h"
#include "core/magnetometer/localization.h"
#include "core/parallel.h"
#include "estimators/initialization/field_search.h"

namespace lodestone {

namespace {

constexpr double kFloorThickness_m = 0.15;
constexpr double kSearchRange_m = 40.0;  // points farther from the robot are ignored by the search
constexpr int kSearchPoints = 500;       // number of points of the scan that the search uses, evenly distributed
constexpr std::size_t kJudgedPoints = 1500;
constexpr std::size_t kFewPoints = 600;          // of the scan, registered at each of some hundred places
constexpr std::size_t kRegisteredPoints = 2500;  // registered at the best of these places
constexpr std::size_t kRegisteredTwice = 80;
constexpr double kTilesTogether_m = 32.0;
constexpr double kSamePlace_m = 0.25;
constexpr double kSameHeading_rad = 3.0 * degree;
constexpr double kArrayCrowding = 3.0;  // number of readings that share one error of the map
constexpr double kMapError_ut = 0.5;

std::vector<SiteLevel> levels_of(const PlaneMapSource& planes) {
  std::vector<SiteLevel> levels = find_levels(planes, PlaceSearch::margin_cells);
  if (levels.empty()) {
    throw InputError("--initial-pose auto: the cloud map has no level floor; give the initial pose instead");
  }
  return levels;
}

/// Best first; of those at the same place, the best.
std::vector<StartCandidate> different(std::vector<StartCandidate> candidates) {
  std::stable_sort(candidates.begin(), candidates.end(), [](const StartCandidate& a, const StartCandidate& b) {
    return a.log_likelihood > b.log_likelihood;
  });
  std::vector<StartCandidate> result;
  for (const StartCandidate& candidate : candidates) {
    const bool known = std::any_of(result.begin(), result.end(), [&](const StartCandidate& other) {
      return are_near(other.T_map_imu, candidate.T_map_imu, kSamePlace_m, kSameHeading_rad);
    });
    if (!known) result.push_back(candidate);
  }
  return result;
}

}  // namespace

StartEvidence::StartEvidence(const SensorSuite& suite, const MagneticMap* field) : suite_(suite), field_(field) {
  if (field_ != nullptr) background_ = field_background(*field_);
}

void StartEvidence::weigh(std::span<const Eigen::Vector3f> points, const ArrayReading* array, const PlaneMap& planes,
                          StartCandidate& candidate) const {
  candidate.lidar = agreement(points, candidate.T_map_imu, planes);
  candidate.log_likelihood = scan_log_likelihood(points.size(), candidate.lidar.clutter_cost);
  if (field_ == nullptr || array == nullptr) return;
  candidate.field = field_evidence(*array, candidate.T_map_imu, suite_, *field_, background_);
  candidate.log_likelihood += candidate.field.log_likelihood;
}

std::optional<Pose> StartEvidence::moved_by_field(const Pose& T_map_imu, const Matrix6& information,
                                                  const ArrayReading* array) const {
  if (field_ == nullptr || array == nullptr) return std::nullopt;
  std::vector<LocalizationReading> readings;
  for (const MeanReading& reading : array->readings) {
    const double noise = suite_.magnetometers[static_cast<std::size_t>(reading.magnetometer)].noise_ut;
    readings.push_back({reading.T_end_mag, reading.measured_ut,
                        noise * noise / reading.samples + kArrayCrowding * kMapError_ut * kMapError_ut});
  }
  Vector6 trust;
  trust << Vector3::Constant(std::pow(3.0 * degree, -2)), Vector3::Constant(std::pow(0.25, -2));
  const Matrix6 with_trust = information + Matrix6(trust.asDiagonal());
  const Matrix6 covariance = with_trust.ldlt().solve(Matrix6::Identity());
  const Matrix6 symmetric = 0.5 * (covariance + covariance.transpose());
  const MagneticLocalization localized = localize(T_map_imu, symmetric, readings, *field_, {});
  if (2 * localized.used <= static_cast<int>(readings.size())) return std::nullopt;
  return localized.T_map_imu;
}

double StartEvidence::nowhere(std::span<const Eigen::Vector3f> points, const ArrayReading* array,
                              const Quaternion& attitude) const {
  double result = scan_log_likelihood_off_map(points.size());
  if (field_ != nullptr && array != nullptr) {
    result += field_log_likelihood_off_map(*array, attitude, suite_, *field_, background_);
  }
  return result;
}

std::vector<Eigen::Vector3f> above_floor(const StartScan& scan) {
  const Vector3 normal = scan.ground ? scan.ground->normal : scan.up;
  const double height_m = height_above_floor(scan);
  std::vector<Eigen::Vector3f> result;
  for (const Eigen::Vector3f& point : scan.points) {
    if (std::abs(normal.dot(point.cast<double>()) + height_m) > kFloorThickness_m) result.push_back(point);
  }
  return thinned(std::move(result), kJudgedPoints);
}

StartSearch::StartSearch(const PlaneMapSource& planes, const MagneticMap* field, const SensorSuite& suite,
                         const AssociationOptions& association, const PlaceSearchOptions& options)
    : planes_(planes),
      field_(field),
      suite_(suite),
      association_(association),
      search_(levels_of(planes), options),
      evidence_(suite, field) {}

Pose StartSearch::pose_of(const Place& place, const Quaternion& attitude, double height_m) const {
  const SiteLevel& level = search_.levels()[static_cast<std::size_t>(place.level)];
  const int column = std::clamp(level.column_of(place.position_m.x()), 0, level.columns - 1);
  const int row = std::clamp(level.row_of(place.position_m.y()), 0, level.rows - 1);
  const double floor_m = static_cast<double>(level.floor_m[level.index(column, row)]);
  return {(Quaternion(Eigen::AngleAxisd(place.yaw, Vector3::UnitZ())) * attitude).normalized(),
          {place.position_m.x(), place.position_m.y(), floor_m + height_m}};
}

StartCandidates StartSearch::find(const StartScan& scan, const ArrayReading* array) const {
  StartCandidates result;
  const Quaternion attitude = start_attitude(scan);
  const double height_m = height_above_floor(scan);
  const std::vector<SearchPoint> points = search_points(scan, kSearchRange_m, kSearchPoints);
  const std::vector<Eigen::Vector3f> judged = above_floor(scan);

  PlaceSearchResult by_lidar = search_.best(points);
  result.complete = by_lidar.complete;
  std::vector<Place> places = std::move(by_lidar.places);
  if (field_ != nullptr && array != nullptr) {
    const std::vector<Place> by_field = search_field(*array, attitude, height_m, *field_, search_, points);
    places.insert(places.end(), by_field.begin(), by_field.end());
  }
  // Sorted by neighbourhood, so that each tile of a large map is loaded once.
  const auto tile = [](const Place& place) {
    const Eigen::Vector2d scaled = place.position_m / kTilesTogether_m;
    return std::pair{std::floor(scaled.x()), std::floor(scaled.y())};
  };
  std::stable_sort(places.begin(), places.end(), [&](const Place& a, const Place& b) { return tile(a) < tile(b); });

  std::vector<StartCandidate> candidates(places.size());
  const auto register_with = [&](std::size_t most_points, std::span<const std::size_t> chosen) {
    const std::vector<Eigen::Vector3f> points = thinned(scan.points, most_points);
    ScanLidars lidars = scan.lidars;
    lidars.of_points = thinned(scan.lidars.of_points, most_points);
    // The errors of a scan's many points are correlated, so its information is reduced.
    const double share = 0.1 * static_cast<double>(std::min(scan.points.size(), kRegisteredPoints)) /
                         static_cast<double>(std::max<std::size_t>(points.size(), 1));
    parallel_for(std::size_t{0}, chosen.size(), [&](std::size_t i) {
      StartCandidate& candidate = candidates[chosen[i]];
      const Pose rough = pose_of(places[chosen[i]], attitude, height_m);
      const auto planes = planes_.around(rough.position);
      const RegisteredScan registered = register_scan(points, rough, *planes, lidars, association_);
      candidate.T_map_imu = evidence_.moved_by_field(registered.T_map_imu, share * registered.information, array)
                                .value_or(registered.T_map_imu);
      evidence_.weigh(judged, array, *planes, candidate);
    });
  };
  std::vector<std::size_t> order(places.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  register_with(kFewPoints, order);
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return candidates[a].log_likelihood > candidates[b].log_likelihood;
  });
  register_with(kRegisteredPoints, std::span(order).first(std::min(order.size(), kRegisteredTwice)));
  result.found = different(std::move(candidates));
  return result;
}

}  // namespace lodestone

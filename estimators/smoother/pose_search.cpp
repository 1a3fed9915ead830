#include "estimators/smoother/pose_search.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "core/imu/scan_motion.h"
#include "core/lidar/deskew.h"
#include "core/lidar/places_in_map.h"
#include "core/log_odds.h"
#include "core/magnetometer/array_reading.h"
#include "core/magnetometer/field_residual.h"
#include "core/parallel.h"
#include "estimators/initialization/scan_registration.h"

namespace lodestone {

namespace {

constexpr std::size_t kPoints = 400;     // of a scan, since a grid has thousands of poses
constexpr std::size_t kFewer = 4;        // of these points, one is used for a rough fit
constexpr double kPlaneSlack_m = 0.2;    // distance from the plane at which a point still counts
constexpr double kFieldSlack_ut = 4.0;   // change of the field within a step of the grid
constexpr double kClearlyBetter = 0.12;  // difference of the shares that fit
constexpr double kAsGood = 0.04;
constexpr int kNearSteps = 2;  // of the finer grids about a pose
/// Scale of the poses near a given one: to 0.1 m and 1°, within reach of a linearization.
constexpr double kNearScale = 0.5;

/// All poses of a grid, as steps along each direction.
std::vector<std::vector<int>> places(const std::vector<SearchDirection>& directions) {
  std::vector<std::vector<int>> result{{}};
  for (const SearchDirection& direction : directions) {
    std::vector<std::vector<int>> longer;
    for (const std::vector<int>& place : result) {
      for (int step = -direction.steps; step <= direction.steps; ++step) {
        longer.push_back(place);
        longer.back().push_back(step);
      }
    }
    result = std::move(longer);
  }
  return result;
}

/// Those of a grid with few steps.
std::vector<std::vector<int>> near_places(std::vector<SearchDirection> directions) {
  for (SearchDirection& direction : directions) direction.steps = std::min(direction.steps, kNearSteps);
  return places(directions);
}

Pose pose_at(const Pose& about, const std::vector<SearchDirection>& directions, const std::vector<int>& place,
             double scale) {
  Vector6 step = Vector6::Zero();
  for (std::size_t i = 0; i < place.size(); ++i) step += scale * place[i] * directions[i].axis;
  return about.boxplus(step);
}

}  // namespace

PoseSearch::PoseSearch(const EstimatorInput& input, const Keyframe& keyframe, const NavState& state,
                       const std::function<Vector3(int)>& bias_ut)
    : input_(input), field_(input.field) {
  const ScanMotion motion(state, keyframe.imu);
  if (input.planes != nullptr) {
    planes_ = input.planes->around(state.T_map_imu.position);
    const std::vector<Eigen::Vector3f> all =
        deskew(keyframe.points, keyframe.scan_start, motion, input.suite.lidar.T_imu_lidar);
    const std::size_t every = std::max<std::size_t>(1, all.size() / kPoints);
    std::vector<LidarPoint> chosen;
    for (std::size_t i = 0; i < all.size(); i += every) {
      points_.push_back(all[i]);
      chosen.push_back(keyframe.points[i]);
    }
    lidars_.emplace(input.suite.lidars(), chosen);
    for (std::size_t i = 0; i < points_.size(); i += kFewer) few_points_.push_back(points_[i]);
  }
  if (field_ == nullptr || keyframe.magnetic.empty()) return;
  // One mean reading per magnetometer, over at most the last tenth of a second.
  for (ArrayReading& array :
       average_array(keyframe.magnetic, motion, input.suite, input.options.magnetic.samples_per_reading)) {
    for (MeanReading& reading : array.readings) {
      const double noise = input.suite.magnetometers[static_cast<std::size_t>(reading.magnetometer)].noise_ut;
      reading.measured_ut -= bias_ut(reading.magnetometer);
      readings_.push_back({reading.T_end_mag, reading.measured_ut, noise / std::sqrt(reading.samples)});
    }
    newest_array_ = std::move(array);
  }
}

double PoseSearch::fit(const Pose& T_map_imu, double slack) const {
  return fit_of(points_, T_map_imu, slack);
}

double PoseSearch::rough_fit(const Pose& T_map_imu, double slack) const {
  return fit_of(few_points_, T_map_imu, slack);
}

double PoseSearch::fit_of(std::span<const Eigen::Vector3f> points, const Pose& T_map_imu, double slack) const {
  double result = 0.0;
  if (!points.empty()) {
    const auto reach = static_cast<float>(kPlaneSlack_m * slack);
    const std::vector<Eigen::Vector3f> places = places_in_map(points, T_map_imu);
    std::vector<const Plane*> planes(places.size());
    planes_->match(places, reach, planes);
    double sum = 0.0;
    for (std::size_t i = 0; i < places.size(); ++i) {
      if (planes[i] == nullptr) continue;
      sum += 1.0 - std::pow(static_cast<double>(planes[i]->distance(places[i])) / static_cast<double>(reach), 2);
    }
    result += sum / static_cast<double>(places.size());
  }
  if (!readings_.empty()) {
    double sum = 0.0;
    for (const Reading& reading : readings_) {
      const auto value = field_->query(T_map_imu * reading.T_end_mag.position, FieldInterpolation::bilinear);
      if (!value) continue;
      const double squared_ut =
          field_residual(T_map_imu, reading.T_end_mag, reading.measured_ut, *value).residual_ut.squaredNorm();
      const double variance = 3.0 * (std::pow(kFieldSlack_ut * slack, 2) + std::pow(reading.sigma_ut, 2) +
                                     std::pow(static_cast<double>(value->sigma_ut), 2));
      sum += std::exp(-0.5 * squared_ut / variance);
    }
    result += sum / static_cast<double>(readings_.size());
  }
  return result;
}

double PoseSearch::log_likelihood(const Pose& T_map_imu, const FieldBackground& background) const {
  double result = 0.0;
  if (!points_.empty()) {
    result += scan_log_likelihood(points_.size(), agreement(points_, T_map_imu, *planes_).clutter_cost);
  }
  if (has_readings()) {
    result += field_evidence(newest_array_, T_map_imu, input_.suite, *field_, background).log_likelihood;
  }
  return result;
}

double PoseSearch::log_likelihood_off_map(const Quaternion& attitude, const FieldBackground& background) const {
  double result = points_.empty() ? 0.0 : scan_log_likelihood_off_map(points_.size());
  if (has_readings()) {
    result += field_log_likelihood_off_map(newest_array_, attitude, input_.suite, *field_, background);
  }
  return result;
}

Pose PoseSearch::registered(const Pose& start) const {
  if (points_.empty()) return start;
  constexpr int kRounds = 6;  // a round moves by some decimetres and degrees at most
  constexpr double kArrived_m = 0.02;
  Pose pose = start;
  for (int round = 0; round < kRounds; ++round) {
    const Pose before = pose;
    pose = register_scan(points_, before, *planes_, *lidars_, input_.options.lidar.association).T_map_imu;
    if (pose.boxminus(before).tail<3>().norm() < kArrived_m) break;
  }
  return pose;
}

std::optional<Pose> PoseSearch::find(const Pose& about, const std::vector<SearchDirection>& directions,
                                     const Matrix6& covariance,
                                     const std::function<FieldBackground()>& background) const {
  const std::optional<Pose> found = best_fit(about, directions);
  if (!found) return std::nullopt;
  const Eigen::LDLT<Matrix6> prior(covariance);
  const FieldBackground of_map = has_readings() ? background() : FieldBackground{};
  const auto evidence = [&](const Pose& pose) {
    const Vector6 moved = pose.boxminus(about);
    return log_likelihood(pose, of_map) - 0.5 * moved.dot(prior.solve(moved));
  };
  const double most_elsewhere = evidence(*found) - log_odds(input_.options.search.min_probability);
  if (!(evidence(about) < most_elsewhere)) return std::nullopt;
  // Where the mounting is inexact or the map is bent, nothing fits at the true pose itself, but well a few centimetres
  // and tenths of a degree beside it. The best of these stands for the pose that is given.
  const std::vector<std::vector<int>> near = near_places(directions);
  std::vector<double> values(near.size());
  parallel_for(std::size_t{0}, near.size(),
               [&](std::size_t i) { values[i] = evidence(pose_at(about, directions, near[i], kNearScale)); });
  if (!(*std::max_element(values.begin(), values.end()) < most_elsewhere)) return std::nullopt;
  return found;
}

std::optional<Pose> PoseSearch::best_fit(const Pose& about, const std::vector<SearchDirection>& directions) const {
  const std::vector<std::vector<int>> grid = places(directions);
  std::vector<double> fits(grid.size());
  parallel_for(std::size_t{0}, grid.size(),
               [&](std::size_t i) { fits[i] = fit(pose_at(about, directions, grid[i], 1.0), 1.0); });
  const double most = *std::max_element(fits.begin(), fits.end());
  if (most < fit(about, 1.0) + kClearlyBetter) return std::nullopt;
  // Of the poses that fit equally well, the nearest: along an unobservable direction the pose does not move, and among
  // repetitions of the structure the closest is chosen.
  std::size_t best = grid.size();
  double nearest = 0.0;
  for (std::size_t i = 0; i < grid.size(); ++i) {
    if (fits[i] < most - kAsGood) continue;
    double far = 0.0;
    for (std::size_t d = 0; d < directions.size(); ++d)
      far += std::pow(static_cast<double>(grid[i][d]) / std::max(1, directions[d].steps), 2);
    if (best < grid.size() && far >= nearest) continue;
    best = i;
    nearest = far;
  }
  // Refines about the best pose, with decreasing steps and slack.
  Pose found = pose_at(about, directions, grid[best], 1.0);
  const std::vector<std::vector<int>> near = near_places(directions);
  for (const double scale : {0.4, 0.16}) {
    const double slack = std::sqrt(scale);
    Pose better = found;
    double highest = fit(found, slack);
    for (const std::vector<int>& place : near) {
      const Pose pose = pose_at(found, directions, place, scale);
      const double value = fit(pose, slack);
      if (value > highest) {
        highest = value;
        better = pose;
      }
    }
    found = better;
  }
  return found;
}

}  // namespace lodestone

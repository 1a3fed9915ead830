#include "estimators/baselines/continuous_time/continuous_time.h"

#include <algorithm>
#include <cmath>

#include "core/stopwatch.h"
#include "estimators/baselines/continuous_time/motion_update.h"
#include "estimators/baselines/scan_degeneracy.h"

namespace lodestone {

/// A part of a scan. Points in the imu frame at their own times.
struct ContinuousTime::Window {
  Time end = 0;
  std::vector<Eigen::Vector3f> points;
  std::vector<float> ages_s;  // of the points at the window's end
  std::vector<std::uint8_t> lidars;
};

/// Statistics of a scan, over its windows.
struct ContinuousTime::Sums {
  int points = 0;
  int correspondences = 0;
  int iterations = 0;        // the most of a window
  double weights = 0.0;      // Huber weights
  double weighted_m2 = 0.0;  // Σ weight r²
  double squares_m2 = 0.0;   // Σ r²

  void operator+=(const Sums& other) {
    points += other.points;
    correspondences += other.correspondences;
    iterations = std::max(iterations, other.iterations);
    weights += other.weights;
    weighted_m2 += other.weighted_m2;
    squares_m2 += other.squares_m2;
  }
};

namespace {

/// The points in the imu frame of the state.
std::vector<Eigen::Vector3f> moved_to(const MotionState& state, std::span<const Eigen::Vector3f> points,
                                      std::span<const float> ages_s) {
  std::vector<Eigen::Vector3f> result(points.size());
  Eigen::Matrix3f rotation;
  Eigen::Vector3f position;
  for (std::size_t i = 0; i < points.size(); ++i) {
    // All points of one firing share their time and so their transform.
    if (i == 0 || ages_s[i] != ages_s[i - 1]) {
      const Pose T_now_then = state.relative_pose(static_cast<double>(ages_s[i]));
      rotation = T_now_then.rotation.toRotationMatrix().cast<float>();
      position = T_now_then.position.cast<float>();
    }
    result[i] = rotation * points[i] + position;
  }
  return result;
}

}  // namespace

ContinuousTime::ContinuousTime(EstimatorInput input, const ContinuousTimeOptions& options)
    : input_(std::move(input)),
      options_(options),
      association_(input_.options.lidar.association),
      lidars_(input_.suite.lidars()),
      sampling_(options.min_localizability, options.localizability_windows) {
  state_.T_map_imu = input_.initial_pose;
  state_.velocity = input_.initial_velocity;
  const InitialOptions& initial = input_.options.initial;
  Vector15 sigma;
  sigma.segment<3>(motion_tangent::rotation).setConstant(initial.rotation_sigma_deg * M_PI / 180.0);
  sigma.segment<3>(motion_tangent::position).setConstant(initial.position_sigma_m);
  sigma.segment<3>(motion_tangent::velocity).setConstant(initial.velocity_sigma_m_s);
  sigma.segment<3>(motion_tangent::angular_velocity).setConstant(options.angular_velocity_sigma_rad_s);
  sigma.segment<3>(motion_tangent::acceleration).setConstant(options.acceleration_sigma_m_s2);
  covariance_ = sigma.cwiseAbs2().asDiagonal();
}

void ContinuousTime::process(const ScanBundle& bundle, EstimateSink& sink) {
  const Stopwatch step;
  if (!started_) {
    time_ = bundle.scan.start;
    started_ = true;
  }
  const MotionNoise noise{options_.angular_acceleration_density_rad_s2_sqrt_hz, options_.jerk_density_m_s3_sqrt_hz};
  const auto predict = [&](Time time) {
    if (time <= time_) return;
    state_ = propagate_motion(state_, to_seconds(time - time_), noise, covariance_);
    time_ = time;
  };
  predict(bundle.scan.start);
  Sums sums;
  for (Window& window : divide(bundle.scan)) {
    predict(window.end);
    update(window, sums);
  }

  Estimate estimate;
  estimate.time = bundle.scan.end;
  estimate.state.T_map_imu = state_.T_map_imu;
  estimate.state.velocity = state_.velocity;
  estimate.state.gravity = Vector3(0.0, 0.0, -input_.suite.gravity_m_s2);
  estimate.covariance = covariance_.topLeftCorner<6, 6>();
  Diagnostics& diagnostics = estimate.diagnostics;
  diagnostics.points = sums.points;
  diagnostics.correspondences = sums.correspondences;
  diagnostics.iterations = sums.iterations;
  if (sums.correspondences > 0) {
    diagnostics.inlier_share = static_cast<double>(sums.correspondences) / static_cast<double>(sums.points);
    diagnostics.lidar_rmse_m = std::sqrt(sums.weighted_m2 / sums.weights);
    diagnostics.lidar_nis = sums.squares_m2 / (sums.correspondences * options_.point_sigma_m * options_.point_sigma_m);
  }
  set_degeneracy(input_, bundle, estimate);
  diagnostics.step_ms = step.elapsed_ms();
  sink.causal(estimate);
  sink.best(estimate);
}

void ContinuousTime::finish(EstimateSink&) {}

/// Windows of equal length from the state's time to the scan's end. Points before belong to the first window.
std::vector<ContinuousTime::Window> ContinuousTime::divide(const LidarScan& scan) const {
  const Time length = scan.end - time_;
  if (length <= 0) return {};
  const Time count = std::max<Time>(1, std::llround(std::ceil(to_seconds(length) / options_.window_s - 1e-6)));
  std::vector<Window> windows(static_cast<std::size_t>(count));
  for (Time i = 0; i < count; ++i) windows[static_cast<std::size_t>(i)].end = time_ + length * (i + 1) / count;
  const Pose& T_imu_lidar = input_.suite.lidar.T_imu_lidar;
  for (const LidarPoint& point : sample_scan(scan, lidars_, options_.sampling)) {
    const Time time = scan.start + point.offset_ns;
    const auto later = [](const Window& window, Time at) { return window.end < at; };
    auto window = std::lower_bound(windows.begin(), windows.end(), time, later);
    if (window == windows.end()) --window;
    window->points.push_back((T_imu_lidar * point.position.cast<double>()).cast<float>());
    window->ages_s.push_back(static_cast<float>(to_seconds(window->end - time)));
    window->lidars.push_back(point.lidar);
  }
  return windows;
}

void ContinuousTime::keep_localizing(Window& window) {
  const auto planes = input_.planes->around(state_.T_map_imu.position);
  const Eigen::Matrix3f rotation = state_.T_map_imu.rotation.toRotationMatrix().cast<float>();
  std::vector<ObservedDirections> observed;
  observed.reserve(window.points.size());
  for (const Eigen::Vector3f& point : moved_to(state_, window.points, window.ages_s)) {
    const Eigen::Vector3f lever = rotation * point;
    const Eigen::Vector3f place = (lever.cast<double>() + state_.T_map_imu.position).cast<float>();
    const Plane* plane = planes->match(place, static_cast<float>(association_.max_distance_m));
    ObservedDirections directions;
    if (plane != nullptr) {
      directions.translation = plane->normal.cast<double>();
      directions.rotation = lever.cast<double>().cross(directions.translation).normalized();
    }
    observed.push_back(directions);
  }
  std::size_t size = 0;
  for (const std::size_t i : sampling_.sample(observed)) {
    window.points[size] = window.points[i];
    window.ages_s[size] = window.ages_s[i];
    window.lidars[size] = window.lidars[i];
    ++size;
  }
  window.points.resize(size);
  window.ages_s.resize(size);
  window.lidars.resize(size);
}

void ContinuousTime::update(Window& window, Sums& sums) {
  // Without measurements for long, the state may be anywhere.
  if (window.points.empty() || !has_voxels_around(*input_.planes, state_.T_map_imu.position)) return;
  if (options_.min_localizability > 0.0) keep_localizing(window);
  ScanLidars lidars(lidars_.front());
  lidars.models = lidars_;
  lidars.of_points = window.lidars;
  const double variance_m2 = options_.point_sigma_m * options_.point_sigma_m;
  Sums last;  // of the last iteration
  const auto evidence = [&](const MotionState& state) {
    MotionEvidence result;
    last = {};
    const auto planes = input_.planes->around(state.T_map_imu.position);
    const std::vector<Correspondence> matches =
        associate(moved_to(state, window.points, window.ages_s), state.T_map_imu, covariance_.topLeftCorner<6, 6>(),
                  *planes, lidars, association_, window.ages_s);
    last.points = static_cast<int>(window.points.size());
    last.correspondences = static_cast<int>(matches.size());
    for (const Correspondence& match : matches) {
      const Vector3 point = match.point.cast<double>();
      const Vector3 normal = match.plane->normal.cast<double>();
      const double residual_m = normal.dot(state.T_map_imu * point - match.plane->center.cast<double>());
      const Vector15 jacobian = state.point_jacobian(point, normal, static_cast<double>(match.age_s));
      const double weight = static_cast<double>(match.robust_weight);
      result.information.selfadjointView<Eigen::Lower>().rankUpdate(jacobian, weight / variance_m2);
      result.gradient += weight / variance_m2 * residual_m * jacobian;
      last.weights += weight;
      last.weighted_m2 += weight * residual_m * residual_m;
      last.squares_m2 += residual_m * residual_m;
    }
    result.information = Matrix15(result.information.selfadjointView<Eigen::Lower>());
    return result;
  };
  const MotionUpdate updated = update_motion(state_, covariance_, evidence, options_.iterations);
  state_ = updated.state;
  covariance_ = updated.covariance;
  last.iterations = updated.iterations;
  sums += last;
}

}  // namespace lodestone

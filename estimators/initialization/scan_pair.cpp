#include "estimators/initialization/scan_pair.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "core/imu/propagation.h"
#include "core/imu/scan_motion.h"
#include "core/lidar/deskew.h"
#include "estimators/initialization/scan_registration.h"
#include "estimators/initialization/start_scan.h"

namespace lodestone {

namespace {

constexpr double kStep_m = 0.2;         // of the grid, at the second scan
constexpr double kReachSigmas = 2.0;    // of the grid
constexpr int kMostSteps = 30;          // of it, to each side
constexpr std::size_t kCompared = 600;  // points of each scan
constexpr std::size_t kRegistered = 8;  // best velocities
constexpr int kRounds = 3;              // of deskewing and registering

/// A part of a scan's points, with their times.
struct TimedScan {
  TimedScan(const ScanBundle& measured, const SensorSuite& suite)
      : bundle(measured), points(thinned(measured.scan.points, kCompared)), lidars(suite.lidars(), points) {}
  double mean_age_s() const {
    const std::vector<float> ages = ages_at(bundle.scan.end, points, bundle.scan.start);
    return std::accumulate(ages.begin(), ages.end(), 0.0) / static_cast<double>(ages.size());
  }

  const ScanBundle& bundle;
  std::vector<LidarPoint> points;
  ScanLidars lidars;
};

/// Hypotheses of the velocity at the end of the first of two scans.
class ScanPair {
 public:
  ScanPair(std::span<const ScanBundle> bundles, const NavState& state, double sigma_m_s, const EstimatorInput& input)
      : input_(input),
        scans_{TimedScan(bundles.front(), input.suite), TimedScan(bundles.back(), input.suite)},
        state_(state),
        variance_m2_s2_(sigma_m_s * sigma_m_s),
        between_(imu_of(bundles.subspan(1))),
        age_s_(scans_[0].mean_age_s()),
        lag_s_(to_seconds(bundles.back().scan.end - bundles.front().scan.end)) {}

  double lag_s() const { return lag_s_; }

  /// At another velocity, the points in the scan's middle stay where they were registered.
  NavState start(const Vector3& velocity) const {
    NavState state = state_;
    state.T_map_imu.position += age_s_ * (velocity - state_.velocity);
    state.velocity = velocity;
    return state;
  }

  PairMotion motion(const NavState& first) const {
    return {first, propagate(first, between_, input_.suite.imu, nullptr)};
  }

  /// Mean cost of both scans' points, and of the velocity in the same unit.
  double cost(const NavState& first) const {
    const PairMotion pair = motion(first);
    const double of_scans = cost(scans_[0], pair.first) + cost(scans_[1], pair.second);
    const double of_velocity = 0.5 * (first.velocity - state_.velocity).squaredNorm() / variance_m2_s2_;
    return 0.5 * (of_scans + of_velocity / kIndependentPoints);
  }

  /// The motion after registration of both scans.
  NavState registered(const NavState& first) const {
    const PairMotion pair = motion(first);
    NavState result = first;
    result.T_map_imu = registered(scans_[0], pair.first);
    const Vector3 moved_first = result.T_map_imu.position - first.T_map_imu.position;
    const Vector3 moved_second = registered(scans_[1], pair.second).position - pair.second.T_map_imu.position;
    result.velocity += (moved_second - moved_first) / lag_s_;
    return result;
  }

 private:
  std::vector<Eigen::Vector3f> points(const TimedScan& scan, const NavState& end) const {
    return deskew(scan.points, scan.bundle.scan.start, ScanMotion(end, scan.bundle.imu),
                  input_.suite.lidar.T_imu_lidar);
  }
  double cost(const TimedScan& scan, const NavState& end) const {
    const Pose& pose = end.T_map_imu;
    return agreement(points(scan, end), pose, *input_.planes->around(pose.position)).clutter_cost;
  }
  Pose registered(const TimedScan& scan, const NavState& end) const {
    const Pose& pose = end.T_map_imu;
    return register_scan(points(scan, end), pose, *input_.planes->around(pose.position), scan.lidars,
                         input_.options.lidar.association)
        .T_map_imu;
  }

  const EstimatorInput& input_;
  std::array<TimedScan, 2> scans_;
  NavState state_;
  double variance_m2_s2_;
  std::vector<ImuSample> between_;
  double age_s_;
  double lag_s_;
};

/// Horizontal changes of the velocity, the smallest first.
std::vector<Vector3> grid(double step_m_s, double reach_m_s) {
  const int most = static_cast<int>(std::min(std::ceil(reach_m_s / step_m_s), 1.0 * kMostSteps));
  std::vector<Vector3> changes;
  for (int x = -most; x <= most; ++x) {
    for (int y = -most; y <= most; ++y) {
      const Vector3 change = step_m_s * Vector3(x, y, 0.0);
      if (change.norm() <= reach_m_s) changes.push_back(change);
    }
  }
  std::stable_sort(changes.begin(), changes.end(),
                   [](const Vector3& a, const Vector3& b) { return a.squaredNorm() < b.squaredNorm(); });
  return changes;
}

}  // namespace

PairMotion find_motion(std::span<const ScanBundle> bundles, const NavState& state, double sigma_m_s,
                       const EstimatorInput& input) {
  const ScanPair pair(bundles, state, sigma_m_s, input);
  std::vector<NavState> starts;
  std::vector<double> costs;
  for (const Vector3& change : grid(kStep_m / pair.lag_s(), kReachSigmas * sigma_m_s)) {
    starts.push_back(pair.start(state.velocity + change));
    costs.push_back(pair.cost(starts.back()));
  }
  std::vector<std::size_t> order(starts.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return costs[a] < costs[b]; });

  // Where few points tell a direction, registration may leave a good place.
  NavState best = starts[order.front()];
  double least = costs[order.front()];
  for (const std::size_t i : std::span(order).first(std::min(order.size(), kRegistered))) {
    NavState registered = starts[i];
    for (int round = 0; round < kRounds; ++round) {
      registered = pair.registered(registered);
      const double cost = pair.cost(registered);
      if (!(cost < least)) continue;
      best = registered;
      least = cost;
    }
  }
  return pair.motion(best);
}

}  // namespace lodestone

#include "estimators/health/nearby_place.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/lidar/scan_lidars.h"
#include "core/parallel.h"
#include "estimators/initialization/scan_registration.h"
#include "estimators/initialization/start_scan.h"

namespace lodestone {

namespace {

constexpr double kNearbyStep_m = 0.25;   // of the starts: a registration converges from 0.3 m
constexpr double kNearbyReach_m = 1.5;   // of the starts
constexpr double kNearbyApart_m = 0.25;  // a place closer than this is the estimate's
constexpr std::size_t kNearbyStarts = 5;
constexpr double kNearbyAsGood = 0.05;  // share of points by which a start may fit worse than the estimate
constexpr std::size_t kNearbyPoints = 1300;
constexpr double kLook_s = 0.5;
constexpr double kLook_m = 0.5;
constexpr double kSameWay_m = 0.3;  // between the ways from two estimates to their better places: errors grow

Pose moved(const Pose& T_map_imu, const Vector3& way) {
  return {T_map_imu.rotation, T_map_imu.position + way};
}

std::vector<Pose> starts_around(const Pose& about) {
  std::vector<Pose> starts;
  const int most = static_cast<int>(kNearbyReach_m / kNearbyStep_m);
  for (int x = -most; x <= most; ++x) {
    for (int y = -most; y <= most; ++y) {
      const Vector3 way = kNearbyStep_m * Vector3(x, y, 0.0);
      if (way.norm() > kNearbyStep_m && way.norm() <= kNearbyReach_m) starts.push_back(moved(about, way));
    }
  }
  return starts;
}

/// The best of the starts that fit about as well as the estimate, best first.
std::vector<Pose> best_starts(const JudgedScan& scan, const PlaneMap& map) {
  const std::vector<Pose> starts = starts_around(scan.T_map_imu);
  std::vector<double> shares(starts.size());
  parallel_for(std::size_t{0}, starts.size(),
               [&](std::size_t i) { shares[i] = share_on_map(scan.even, starts[i], map); });
  std::vector<std::size_t> order(starts.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return shares[a] > shares[b]; });
  const double least = share_on_map(scan.even, scan.T_map_imu, map) - kNearbyAsGood;
  std::vector<Pose> best;
  for (const std::size_t i : order) {
    if (best.size() == kNearbyStarts || shares[i] < least) break;
    best.push_back(starts[i]);
  }
  return best;
}

}  // namespace

std::optional<NearbyPlace> find_nearby(const JudgedScan& scan, const NavState& state, const PlaneMap& map,
                                       const SensorSuite& suite, const AssociationOptions& association,
                                       const std::function<double(const Pose&)>& readings) {
  if (scan.even.empty()) return std::nullopt;
  std::vector<Pose> starts = best_starts(scan, map);
  if (starts.empty()) return std::nullopt;
  starts.push_back(scan.T_map_imu);
  const ScanLidars lidars(suite.lidars(), thinned(scan.measured, kNearbyPoints));
  const std::vector<Eigen::Vector3f> points = thinned(scan.all, kNearbyPoints);
  const Pose to_state = scan.T_map_imu.inverse() * state.T_map_imu;
  const auto likelihood = [&](const Pose& pose) {
    const double of_scan = scan_log_likelihood(scan.even.size(), agreement(scan.even, pose, map).clutter_cost);
    return of_scan + (readings ? readings(pose * to_state) : 0.0);
  };
  std::vector<NearbyPlace> places(starts.size());
  parallel_for(std::size_t{0}, starts.size(), [&](std::size_t i) {
    places[i].T_map_imu = register_scan(points, starts[i], map, lidars, association).T_map_imu;
    places[i].log_odds = likelihood(places[i].T_map_imu);
  });
  // Registered from the estimate itself, it is the better of both; a start may lead back to it, too.
  double here = likelihood(scan.T_map_imu);
  std::optional<NearbyPlace> best;
  for (const NearbyPlace& place : places) {
    if ((place.T_map_imu.position - scan.T_map_imu.position).norm() < kNearbyApart_m) {
      here = std::max(here, place.log_odds);
    } else if (!best || place.log_odds > best->log_odds) {
      best = place;
    }
  }
  if (!best || !(best->log_odds > here)) return std::nullopt;
  return NearbyPlace{best->T_map_imu * to_state, best->log_odds - here};
}

bool NearbyCheck::is_due(const Estimate& causal) const {
  if (!newest_) return true;
  return to_seconds(causal.time - newest_->time) >= kLook_s &&
         (causal.state.T_map_imu.position - newest_->estimated).norm() >= kLook_m;
}

void NearbyCheck::add(const Estimate& causal, const std::optional<NearbyPlace>& found) {
  Look look{causal.time, causal.state.T_map_imu.position, std::nullopt};
  if (found) look.better = found->T_map_imu;
  const auto before = way();
  agree_ = found && before && (*look.way() - *before).norm() < kSameWay_m;
  sum_ = (agree_ ? sum_ : 0.0) + (found ? found->log_odds : 0.0);
  newest_ = look;
}

std::optional<Pose> NearbyCheck::better() const {
  if (!agree_ || !contradicts()) return std::nullopt;
  return newest_->better;
}

void NearbyCheck::restart() {
  *this = NearbyCheck(odds_);
}

}  // namespace lodestone

#include "estimators/health/health_monitor.h"

#include <algorithm>
#include <cmath>

namespace lodestone {

namespace {

constexpr double kUncertain_m = 0.5;
constexpr double kLost_m = 3.0;
constexpr double kStation_m = 1.0;
constexpr std::size_t kStations = 5;
constexpr double kFieldMemory_s = 3.0;
constexpr double kLeastFieldWeight = 0.5;  // below, more than half of the readings contradict the map

Verdict worse(const Verdict& a, const Verdict& b) {
  return b.health > a.health ? b : a;
}

}  // namespace

Verdict judge_covariance(const Estimate& estimate) {
  const double variance_m2 = estimate.covariance.diagonal().tail<3>().maxCoeff();
  if (!estimate.state.T_map_imu.position.allFinite() || !std::isfinite(variance_m2)) {
    return {Health::lost, HealthReason::not_finite};
  }
  if (variance_m2 > kLost_m * kLost_m) return {Health::lost, HealthReason::covariance};
  if (variance_m2 > kUncertain_m * kUncertain_m) return {Health::uncertain, HealthReason::covariance};
  return {};
}

void HealthMonitor::judge(const ScanBundle& bundle, Estimate& causal) {
  const PlaceEvidence evidence = judge_.judge(bundle, causal.state);
  Diagnostics& diagnostics = causal.diagnostics;
  diagnostics.place_share = evidence.scan_share;
  diagnostics.decoy_share = evidence.decoy_share;
  diagnostics.place_points = evidence.scan_points;
  diagnostics.field_odds = evidence.field_odds;
  add_station(evidence, causal);
  const Verdict by_evidence = judge_evidence(causal);
  if (by_evidence.health != Health::good) verdicts_[causal.time] = by_evidence;
  const Verdict verdict = worse(judge_covariance(causal), by_evidence);
  causal.health = verdict.health;
  causal.reason = verdict.reason;
}

Verdict HealthMonitor::judge_refined(const Estimate& refined) const {
  const auto found = verdicts_.find(refined.time);
  return found == verdicts_.end() ? judge_covariance(refined) : worse(judge_covariance(refined), found->second);
}

void HealthMonitor::restart() {
  stations_.clear();
  field_weight_ = 1.0;
  last_ = 0;
}

void HealthMonitor::add_station(const PlaceEvidence& evidence, const Estimate& causal) {
  const Vector3& position = causal.state.T_map_imu.position;
  if (stations_.empty() || !((position - stations_.back().position).norm() < kStation_m)) {
    stations_.push_back({position, 0.0, 0.0});
    if (stations_.size() > kStations) stations_.pop_front();
  }
  stations_.back().field_odds = evidence.field_odds;

  const double step_s = last_ == 0 ? 0.0 : to_seconds(causal.time - last_);
  last_ = causal.time;
  const bool alone = !has_planes_ || causal.diagnostics.degenerate_directions > 0;
  if (!alone) {
    field_weight_ = 1.0;
  } else if (causal.diagnostics.magnetic_samples > 0) {
    field_weight_ += (1.0 - std::exp(-step_s / kFieldMemory_s)) * (causal.diagnostics.magnetic_weight - field_weight_);
  }
}

Verdict HealthMonitor::judge_evidence(const Estimate&) const {
  if (field_weight_ < kLeastFieldWeight) return {Health::lost, HealthReason::field_off_map};
  return {};
}

}  // namespace lodestone

#include "estimators/health/health_monitor.h"

#include <cmath>
#include <numeric>

#include "core/angles.h"
#include "core/log_odds.h"

namespace lodestone {

namespace {

// Thresholds of evidence: docs/design/050-health.md.
constexpr double kScanMemory_s = 0.5;
constexpr double kScanContradicts = 0.25;  // fit of scans
constexpr double kScanUnclear = 0.4;
constexpr double kStation_m = 1.0;
constexpr double kStation_s = 1.0;   // at least, where only the readings show that the robot moves
constexpr double kOtherField = 0.5;  // change of the readings over the map's spread, at another place
constexpr std::size_t kStations = 5;
constexpr std::ptrdiff_t kContradicting = 4;  // stations, the newest, that suffice where nothing fits
const double kNothingFits = kFieldTrust * std::log(kStaleShare);  // odds of a station where the map has changed
constexpr double kFieldFits = 0.4;          // mean odds of the stations over kNothingFits: below, readings fit
constexpr double kFieldContradicts = 0.95;  // above, they do not
constexpr double kFieldMemory_s = 3.0;
constexpr double kLeastFieldWeight = 0.5;  // below, more than half of the readings contradict the map
constexpr double kMostly = 0.5;
constexpr double kDeadReckoning_m_s2 = 0.02;
constexpr double kUnmeasured_m_s2 = 1.0;  // acceleration of a robot without IMU
constexpr double kImuGap_s = 0.1;
constexpr double kLeastClaim = 0.1;
constexpr double kObserved_s = 1.0;  // after which scans give position and velocity anew
constexpr double kLearned_s = 5.0;   // after which they give tilt and bias: 2 cm once a second are 0.01 m/s²
constexpr double kReach_s = 5.0;     // of a loss, back to the scans that caused it

Verdict worse(const Verdict& a, const Verdict& b) {
  return b.health > a.health ? b : a;
}

}  // namespace

void HealthMonitor::DeadReckoning::add(double step_s, const ScanBundle& bundle) {
  time_s += step_s;
  if (bundle.imu_gap_s > kImuGap_s) gap_s += step_s;
}

double HealthMonitor::DeadReckoning::sigma_m(double acceleration_m_s2) const {
  return 0.5 * acceleration_m_s2 * time_s * time_s + 0.5 * kUnmeasured_m_s2 * gap_s * gap_s;
}

HealthMonitor::HealthMonitor(const EstimatorInput& input, Reckoning reckoning)
    : judge_(input),
      has_scans_(input.planes != nullptr),
      by_field_(input.planes == nullptr && input.field != nullptr),
      reckoning_(reckoning),
      initial_velocity_m_s_(input.options.initial.velocity_sigma_m_s),
      tilt_m_s2_(input.suite.gravity_m_s2 * input.suite.calibration.lidar.rotation_sigma_deg * degree),
      nearby_(log_odds(input.options.search.min_probability)) {}

/// Of an estimate that is only dead reckoned.
double HealthMonitor::unknown_acceleration_m_s2() const {
  if (reckoning_ == Reckoning::scans) return kUnmeasured_m_s2;
  const bool learned = reckoning_ == Reckoning::learned_imu && learned_s_ >= kLearned_s;
  return learned ? kDeadReckoning_m_s2 : std::hypot(kDeadReckoning_m_s2, tilt_m_s2_);
}

void HealthMonitor::judge(const ScanBundle& bundle, Estimate& causal) {
  const PlaceEvidence evidence = judge_.judge(bundle, causal);
  Diagnostics& diagnostics = causal.diagnostics;
  diagnostics.place_share = evidence.scan_share;
  diagnostics.decoy_share = evidence.decoy_share;
  diagnostics.place_points = evidence.scan_points;
  diagnostics.field_odds = evidence.field_odds;
  const double step_s = last_ == 0 ? 0.0 : to_seconds(causal.time - last_);
  last_ = causal.time;
  const bool scan_contradicts = add_scan(evidence, step_s);
  const bool readings_contradict = add_readings(evidence, causal, step_s);
  confirm(evidence, bundle, causal, step_s);
  if (readings_fit(evidence)) awaits_since_.reset();
  motion_.add(causal);
  const Verdict apart = worse(judge_motion(), judge_nearby(bundle, causal));
  if (scan_contradicts || readings_contradict || apart.health != Health::good) {
    contradicting_.push_back(causal.time);
  } else {
    contradicting_.clear();
  }
  const Verdict own = worse(worse(judge_evidence(), apart), judge_observation(bundle, causal, step_s));
  record(causal.time, own);
  const Verdict by_evidence = worse(own, judge_awaited(causal.time));
  // What is wrong says more than what is unknown: the former's estimator is stopped.
  const Verdict by_covariance = judge_covariance(causal);
  const bool is_finite = by_covariance.reason != HealthReason::not_finite;
  const Verdict verdict = is_finite ? worse(by_evidence, by_covariance) : by_covariance;
  if (by_field_ && verdict.health == Health::lost && !awaits_since_) {
    awaits_since_ = causal.time;
    stations_.clear();
  }
  causal.health = verdict.health;
  causal.reason = verdict.reason;
}

/// Along a direction that nothing observes, the position is that of dead reckoning: no better than ½ a t², with a of
/// the accelerometer's bias and the tilt, or of the robot itself where the IMU is silent too. A covariance far below is
/// that of an estimator that takes noise for information. Once it is lost so, scans that observe all directions again
/// say no more than that it is at some place that looks like this one.
Verdict HealthMonitor::judge_observation(const ScanBundle& bundle, const Estimate& causal, double step_s) {
  const Diagnostics& diagnostics = causal.diagnostics;
  const bool wheels = diagnostics.wheel_weight >= 0.0;
  const bool by_scans = has_scans_ && !bundle.scan.points.empty() && diagnostics.unobserved_directions == 0;
  const bool observed = by_scans || diagnostics.magnetic_samples > 0 || wheels;
  observed_s_ = observed ? observed_s_ + step_s : 0.0;
  if (observed) learned_s_ += step_s;
  if (!observed) {
    unobserved_.add(step_s, bundle);
  } else if (observed_s_ >= kObserved_s || !(unobserved_m() > kUncertainSigma_m)) {
    unobserved_ = {};
  }
  const double sigma_m = unobserved_m();
  const double claimed_m = std::sqrt(position_variance_m2(causal.covariance));
  const bool claims_too_much = claimed_m < kLeastClaim * sigma_m;
  const bool lost = claims_too_much && sigma_m > kLostSigma_m;
  if (lost && has_scans_) astray_ = true;
  if (unconfirmed_s_ == 0.0) astray_ = false;
  if (lost || astray_) return {Health::lost, HealthReason::unobserved};
  if (claims_too_much && sigma_m > kUncertainSigma_m) return {Health::uncertain, HealthReason::unobserved};
  return {};
}

/// One sigma of a position since all directions were last observed. A velocity that never was is the initial one.
double HealthMonitor::unobserved_m() const {
  const double moving_m = learned_s_ < kObserved_s ? initial_velocity_m_s_ * unobserved_.time_s : 0.0;
  return moving_m + unobserved_.sigma_m(unknown_acceleration_m_s2());
}

/// Only an IMU that the estimator has learned gives velocities to compare with: others may be wrong at a right pose.
Verdict HealthMonitor::judge_motion() const {
  const bool knows_velocity = has_scans_ && reckoning_ == Reckoning::learned_imu;
  if (knows_velocity && motion_.apart_m() > kLostSigma_m) return {Health::lost, HealthReason::motion};
  return {};
}

/// Once other places outweigh an estimate, so they did since it was last seen to be the best.
Verdict HealthMonitor::judge_nearby(const ScanBundle& bundle, const Estimate& causal) {
  unclear_.push_back(causal.time);
  if (nearby_.is_due(causal)) {
    const std::optional<NearbyPlace> found = judge_.nearby(bundle, causal);
    nearby_.add(causal, found);
    if (!found) unclear_.clear();
  }
  if (!nearby_.contradicts()) return {};
  constexpr Verdict kNotHere{Health::uncertain, HealthReason::scan_off_map};
  for (const Time time : unclear_) verdicts_.try_emplace(time, kNotHere);
  unclear_.clear();
  return kNotHere;
}

void HealthMonitor::moved() {
  motion_.restart();
  nearby_.restart();
}

Verdict HealthMonitor::judge_refined(const Estimate& refined) const {
  const auto found = verdicts_.find(refined.time);
  const Verdict own =
      found == verdicts_.end() ? judge_covariance(refined) : worse(judge_covariance(refined), found->second);
  return worse(own, judge_awaited(refined.time));
}

/// On a field map alone, an estimate that was lost stays so until the readings of several stations fit.
Verdict HealthMonitor::judge_awaited(Time time) const {
  if (awaits_since_ && time > *awaits_since_) return {Health::lost, HealthReason::unobserved};
  return {};
}

void HealthMonitor::restart() {
  motion_.restart();
  nearby_.restart();
  unclear_.clear();
  scan_fit_.reset();
  contradicting_.clear();
  stations_.clear();
  field_weight_ = 1.0;
  field_alone_ = 0.0;
  odds_decide_ = 0.0;
  unobserved_ = {};
  observed_s_ = 0.0;
  learned_s_ = 0.0;
  astray_ = false;
  awaits_since_.reset();
  unconfirmed_s_ = kNeverConfirmed_s;
  last_ = 0;
}

/// A loss is seen after the scans that cause it. Those that were not good either are lost, too, for estimates that are
/// refined later.
void HealthMonitor::record(Time time, const Verdict& by_evidence) {
  if (by_evidence.health != Health::good) verdicts_[time] = by_evidence;
  if (by_evidence.health != Health::lost) return;
  for (const Time earlier : contradicting_) {
    if (to_seconds(time - earlier) < kReach_s) verdicts_[earlier] = by_evidence;
  }
  contradicting_.clear();
}

bool HealthMonitor::add_scan(const PlaceEvidence& evidence, double step_s) {
  if (evidence.scan_points == 0) return false;
  const double fit = fit_of(evidence);
  scan_fit_ = scan_fit_ ? *scan_fit_ + (1.0 - std::exp(-step_s / kScanMemory_s)) * (fit - *scan_fit_) : fit;
  return fit < kScanUnclear;
}

bool HealthMonitor::add_readings(const PlaceEvidence& evidence, const Estimate& causal, double step_s) {
  if (evidence.field_readings > 0) {
    if (is_next_station(evidence, causal)) {
      stations_.push_back({causal.time, causal.state.T_map_imu.position, evidence.field_ut, 0.0});
      if (stations_.size() > kStations) stations_.pop_front();
    }
    stations_.back().field_odds = evidence.field_odds;
  }
  if (causal.diagnostics.magnetic_samples == 0) return false;
  const double gain = 1.0 - std::exp(-step_s / kFieldMemory_s);
  field_weight_ += gain * (causal.diagnostics.magnetic_weight - field_weight_);
  const bool alone = causal.diagnostics.correspondences == 0 || causal.diagnostics.unobserved_directions > 0;
  field_alone_ += gain * ((alone ? 1.0 : 0.0) - field_alone_);
  const bool decide = causal.diagnostics.unobserved_directions > 0 &&
                      (causal.diagnostics.degenerate_directions == 0 || causal.diagnostics.magnetic_set_aside == 0);
  odds_decide_ += gain * ((decide ? 1.0 : 0.0) - odds_decide_);
  return causal.diagnostics.magnetic_weight < kLeastFieldWeight || stations_contradict();
}

/// An estimate may stand at a wrong place while the robot drives: its readings then change. They also change where
/// steel passes a robot that stands, which says nothing against a confirmed pose.
bool HealthMonitor::is_next_station(const PlaceEvidence& evidence, const Estimate& causal) const {
  if (stations_.empty()) return true;
  const Station& newest = stations_.back();
  const bool waited = to_seconds(causal.time - newest.time) >= kStation_s;
  // The place of a lost estimate may jump while the robot stands.
  if (!((causal.state.T_map_imu.position - newest.position).norm() < kStation_m)) return waited || !awaits_since_;
  return waited && !is_confirmed() &&
         (evidence.field_ut - newest.field_ut).norm() > kOtherField * evidence.field_spread_ut;
}

/// Where readings alone observe a direction, an estimator can follow a field that only looks like the map's: its
/// weights agree with its own prediction. The odds do not decide where the estimator knows of a direction and sets
/// readings aside: they know nothing of a magnetometer with a fault.
bool HealthMonitor::stations_contradict() const {
  if (!(odds_decide_ > kMostly) || std::ssize(stations_) < kContradicting) return false;
  const double newest = std::accumulate(stations_.end() - kContradicting, stations_.end(), 0.0, add_odds);
  return newest < kFieldContradicts * static_cast<double>(kContradicting) * kNothingFits;
}

/// Readings that fit over several metres tell where the robot is. Scans that observe every direction tell its velocity.
void HealthMonitor::confirm(const PlaceEvidence& evidence, const ScanBundle& bundle, const Estimate& causal,
                            double step_s) {
  const bool observed = causal.diagnostics.correspondences > 0 && causal.diagnostics.unobserved_directions == 0;
  unconfirmed_s_ += step_s;
  if (!observed || evidence.scan_points == 0 || *scan_fit_ < kScanUnclear) {
    reckoned_.add(step_s, bundle);
    return;
  }
  if (!readings_fit(evidence)) return;
  unconfirmed_s_ = 0.0;
  reckoned_ = {};
}

bool HealthMonitor::readings_fit(const PlaceEvidence& evidence) const {
  return evidence.field_readings > 0 && evidence.field_odds > 0.0 && std::ssize(stations_) >= kContradicting &&
         sum_of_odds() > -kFieldContradicts * kStations * kNothingFits;
}

bool HealthMonitor::is_confirmed() const {
  return unconfirmed_s_ < kLongestWait_s && !(reckoned_.sigma_m(unknown_acceleration_m_s2()) > kUncertainSigma_m);
}

double HealthMonitor::sum_of_odds() const {
  return std::accumulate(stations_.begin(), stations_.end(), 0.0, add_odds);
}

Verdict HealthMonitor::judge_evidence() const {
  const bool field_contradicts = field_weight_ < kLeastFieldWeight || stations_contradict();
  if (scan_fit_ && *scan_fit_ < kScanContradicts) {
    const double unvisited = static_cast<double>(kStations - stations_.size());  // count as contradictions
    const bool field_fits = sum_of_odds() + unvisited * kNothingFits > kFieldFits * kStations * kNothingFits;
    return {field_fits && !field_contradicts ? Health::uncertain : Health::lost, HealthReason::scan_off_map};
  }
  if (field_contradicts) {
    const bool lost = field_alone_ > kMostly && (stations_contradict() || !is_confirmed());
    return {lost ? Health::lost : Health::uncertain, HealthReason::field_off_map};
  }
  if (scan_fit_ && *scan_fit_ < kScanUnclear) return {Health::uncertain, HealthReason::scan_off_map};
  return {};
}

}  // namespace lodestone

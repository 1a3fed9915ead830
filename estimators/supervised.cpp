#include "estimators/supervised.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/error.h"
#include "core/geometry/pose_distance.h"
#include "core/imu/scan_motion.h"
#include "core/work_times.h"

namespace lodestone {

namespace {

constexpr double kStop_s = 3.0;         // of contradicting the maps, before an estimator is stopped
constexpr double kFirstSearch_s = 1.5;  // of data
constexpr double kEarlyWait_s = 5.0;    // up to it, waits between searches grow slowly: three searches in ten seconds
constexpr double kBlind_s = 1.0;        // IMU gap, after which scans before and after it have nothing in common
constexpr double kForget_s = 10.0;      // without suspicion, after which the next search does not wait
// How fast a robot can be, against the fastest that it was.
constexpr double kFaster = 1.5;
constexpr double kLeastSpeed_m_s = 2.0;
constexpr double kReachMargin_m = 1.0;
constexpr int kConfirmedWithin = 3;  // times the length of a search's data
constexpr double kSamePlace_m = 0.5;
constexpr double kSamePlace_rad = 0.2;

/// The position is not known, but no evidence says that it is wrong.
bool is_unknown(HealthReason reason) {
  return reason == HealthReason::covariance || reason == HealthReason::unobserved;
}

Pose pose_at_end(const StartHypothesis& found, const ScanBundle& first) {
  Pose moved = found.T_map_imu;
  moved.position += to_seconds(first.scan.end - first.scan.start) * found.velocity;
  return moved;
}

bool contradicts_maps(HealthReason reason) {
  return reason == HealthReason::scan_off_map || reason == HealthReason::field_off_map;
}

}  // namespace

/// Judges estimates on their way to another sink. Estimates of times that were reported before are dropped.
class Supervised::JudgingSink final : public EstimateSink {
 public:
  /// `bundle`: that of the causal estimate; null once no more scans are processed.
  JudgingSink(Supervised& owner, const ScanBundle* bundle, Time reported, EstimateSink& sink)
      : owner_(owner), bundle_(bundle), reported_(reported), sink_(sink) {}

  void causal(const Estimate& estimate) override {
    const WorkTimer timer(Work::health);
    Estimate judged = estimate;
    owner_.monitor_.judge(*bundle_, judged);
    owner_.newest_ = judged;
    if (judged.time > reported_) sink_.causal(judged);
  }
  void smoothed(const Estimate& estimate) override {
    if (estimate.time > reported_) sink_.smoothed(refined(estimate));
  }
  void best(const Estimate& estimate) override {
    if (estimate.time > reported_) sink_.best(refined(estimate));
  }

 private:
  Estimate refined(const Estimate& estimate) const {
    Estimate judged = estimate;
    const Verdict verdict = owner_.monitor_.judge_refined(estimate);
    judged.health = verdict.health;
    judged.reason = verdict.reason;
    return judged;
  }

  Supervised& owner_;
  const ScanBundle* bundle_;
  Time reported_;
  EstimateSink& sink_;
};

Supervised::Supervised(EstimatorInput input, Reckoning reckoning, Make make)
    : input_(std::move(input)),
      make_(std::move(make)),
      estimator_(make_(input_)),
      monitor_(input_, reckoning),
      searchable_(input_.planes != nullptr && input_.linearize_at == nullptr) {}

Supervised::~Supervised() = default;

void Supervised::process(const ScanBundle& bundle, EstimateSink& sink) {
  const WorkTimer timer(Work::health);
  const Time now = bundle.scan.end;
  if (stopped_) {
    report_lost(bundle, HealthReason::searching, sink);
  } else {
    if (const auto doubt = std::exchange(left_in_doubt_, std::nullopt)) {
      report_lost(bundle, *doubt, sink);
      reported_ = now;
    }
    estimate(bundle, sink);
    const std::optional<Pose> better = searchable_ ? monitor_.better_nearby() : std::nullopt;
    if (better) {
      move_nearby(bundle, *better, sink);
      return;
    }
    const bool lost = newest_.health == Health::lost;
    if (!lost) lost_since_.reset();
    if (!lost && (!contradicts_maps(newest_.reason) || monitor_.is_confirmed())) {
      suspect_since_.reset();
      kept_.clear();
      return;
    }
    if (lost && !lost_since_) lost_since_ = now;
    if (!searchable_) return;
    suspect(now);
    const double stop_after_s = newest_.reason == HealthReason::not_finite ? 0.0 : kStop_s;
    const bool is_wrong = lost && !is_unknown(newest_.reason);
    const bool is_blind = lost && bundle.imu_gap_s > kBlind_s && bundle.scan.points.empty();
    if (is_blind || (is_wrong && to_seconds(now - *lost_since_) >= stop_after_s)) stop_estimator(sink);
  }
  last_suspect_ = now;
  keep(bundle);
  if (kept_.empty()) return;
  const std::optional<StartHypothesis> found = search();
  if (found && !confirms_estimator(*found) && outweighs_estimator(*found) && believes(*found))
    start_again(*found, sink);
}

void Supervised::suspect(Time now) {
  if (suspect_since_) return;
  suspect_since_ = now;
  if (wait_s_ == 0.0 || to_seconds(now - last_suspect_) > kForget_s) {
    wait_s_ = kFirstSearch_s;
    next_search_ = 0;
  }
  next_search_ = std::max(next_search_, now + from_seconds(kFirstSearch_s));
}

void Supervised::estimate(const ScanBundle& bundle, EstimateSink& sink) {
  JudgingSink judging(*this, &bundle, reported_, sink);
  {
    const WorkTimer timer(Work::estimate);
    estimator_->process(bundle, judging);
  }
  ++scans_;
  if (newest_.health != Health::good) {
    good_since_.reset();
    return;
  }
  settle_search("run.found_again", "");
  if (!good_since_) good_since_ = newest_.time;
  if (to_seconds(newest_.time - *good_since_) < kStop_s) return;
  out_of_reach_.reset();
  last_good_ = Seen{newest_.time, newest_.state.T_map_imu.position,
                    kReachMargin_m + 3.0 * std::sqrt(position_variance_m2(newest_.covariance))};
  fastest_m_s_ = std::max(fastest_m_s_, newest_.state.velocity.norm());
}

/// Says what became of the last place that a search found.
void Supervised::settle_search(const char* kind, const char* outcome) {
  if (unconfirmed_ && input_.warnings != nullptr) {
    input_.warnings->add(kind, unconfirmed_->what + outcome, unconfirmed_->time);
  }
  unconfirmed_.reset();
}

void Supervised::report_lost(const ScanBundle& bundle, HealthReason reason, EstimateSink& sink) {
  Estimate unknown;
  unknown.time = bundle.scan.end;
  unknown.state = newest_.state;
  unknown.covariance = Matrix6::Identity() * 1e6;
  unknown.health = Health::lost;
  unknown.reason = reason;
  sink.causal(unknown);
  if (input_.options.smoother.refine != Refinement::none) sink.smoothed(unknown);
  sink.best(unknown);
}

void Supervised::stop_estimator(EstimateSink& sink) {
  JudgingSink judging(*this, nullptr, reported_, sink);
  estimator_->finish(judging);
  settle_search("run.not_found_again", ", which the following scans did not confirm");
  stopped_ = true;
  if (estimator_->calibration() != nullptr && scans_ > best_scans_) {
    best_calibration_ = *estimator_->calibration();
    best_scans_ = scans_;
  }
}

/// Keeps what a search can track: scans, and the IMU between them.
void Supervised::keep(const ScanBundle& bundle) {
  if (bundle.imu_gap_s > kBlind_s) {
    kept_.clear();
    return;
  }
  kept_.push_back({bundle, newest_});
  const Time oldest = bundle.scan.end - from_seconds(input_.options.search.data_s);
  const auto is_useless = [&](const ScanBundle& kept) { return kept.scan.points.empty() || kept.scan.start < oldest; };
  while (!kept_.empty() && is_useless(kept_.front().bundle)) kept_.pop_front();
}

std::optional<StartHypothesis> Supervised::search() {
  const Time now = kept_.back().bundle.scan.end;
  if (now < next_search_ || to_seconds(now - kept_.front().bundle.scan.start) < kFirstSearch_s) return std::nullopt;
  wait_s_ = std::min((wait_s_ < kEarlyWait_s ? 1.5 : 2.0) * wait_s_, kLongestWait_s);
  next_search_ = now + from_seconds(wait_s_);
  try {
    if (finder_ == nullptr) finder_ = std::make_unique<StartFinder>(input_);
    std::vector<ScanBundle> bundles;
    for (const Kept& kept : kept_) bundles.push_back(kept.bundle);
    return finder_->find_sure(bundles, supposed());
  } catch (const InputError&) {
    // No scan with points, or a map without a floor.
  }
  return std::nullopt;
}

/// Where a running estimator is, and the place beside it that scans prefer: the first kept scan's end.
std::vector<Pose> Supervised::supposed() const {
  const Pose& estimated = kept_.front().causal.state.T_map_imu;
  if (stopped_ || !estimated.position.allFinite() || !estimated.rotation.coeffs().allFinite()) return {};
  std::vector<Pose> result{estimated};
  if (const auto way = monitor_.way_nearby()) result.push_back({estimated.rotation, estimated.position + *way});
  return result;
}

/// Whether to believe that the robot is at the found place: it can have driven there since the last good estimate, or
/// an earlier search found it where it can have come from.
bool Supervised::believes(const StartHypothesis& found) {
  const Time when = kept_.front().bundle.scan.start;
  const double usual_m_s = std::max(kLeastSpeed_m_s, kFaster * fastest_m_s_);
  const auto can_come_from = [&](const Seen& seen, double speed_m_s) {
    const double way_m = speed_m_s * to_seconds(when - seen.time);
    return (found.T_map_imu.position - seen.position).norm() <= seen.radius_m + way_m;
  };
  if (!stopped_ && is_unknown(newest_.reason) && !is_within_reckoning(found)) return false;
  if (!last_good_ || can_come_from(*last_good_, usual_m_s)) return true;
  // The next search has other scans; the first one comes soon.
  const Time data = from_seconds(input_.options.search.data_s);
  const Time next = kept_.back().bundle.scan.end + data;
  if (out_of_reach_ && when - out_of_reach_->time <= kConfirmedWithin * data) {
    if (can_come_from(*out_of_reach_, std::max(usual_m_s, kFaster * found.velocity.norm()))) {
      last_good_.reset();
      return true;
    }
    next_search_ = std::max(next_search_, next);
  } else {
    next_search_ = next;
  }
  out_of_reach_ = Seen{when, found.T_map_imu.position, kReachMargin_m};
  return false;
}

/// Nothing contradicts an estimate that is only unknown: the robot is where it is dead reckoned to be.
bool Supervised::is_within_reckoning(const StartHypothesis& found) const {
  const double sigma_m = std::max(monitor_.unobserved_m(), std::sqrt(position_variance_m2(newest_.covariance)));
  const Vector3& estimated = kept_.front().causal.state.T_map_imu.position;
  return (pose_at_end(found, kept_.front().bundle).position - estimated).norm() <= kReachMargin_m + 3.0 * sigma_m;
}

/// The search found what the running estimator says: it is the maps that have changed.
bool Supervised::confirms_estimator(const StartHypothesis& found) const {
  if (stopped_ || is_unknown(newest_.reason)) return false;
  return are_near(pose_at_end(found, kept_.front().bundle), kept_.front().causal.state.T_map_imu, kSamePlace_m,
                  kSamePlace_rad);
}

/// An estimate that is only in doubt is not left for a place that fits the same scan and readings worse.
bool Supervised::outweighs_estimator(const StartHypothesis& found) {
  if (stopped_ || newest_.health == Health::lost) return true;
  const Kept& first = kept_.front();
  Estimate there = first.causal;
  there.scan_pose.reset();
  there.state.T_map_imu = pose_at_end(found, first.bundle);
  there.state.velocity = found.velocity;
  return outweighs(monitor_.evidence(first.bundle, there), monitor_.evidence(first.bundle, first.causal));
}

/// Scans prefer a place beside the estimate.
void Supervised::move_nearby(const ScanBundle& bundle, const Pose& better, EstimateSink& sink) {
  const Pose T_new_old = better * newest_.state.T_map_imu.inverse();
  if (estimator_->move(T_new_old)) {
    if (input_.warnings != nullptr) {
      input_.warnings->add(
          "run.moved",
          fmt::format("scans fit better beside the estimate; it was moved by {:.2f} m at {:.3f} s",
                      (better.position - newest_.state.T_map_imu.position).norm(), to_seconds(newest_.time)),
          newest_.time);
    }
    last_good_ = Seen{newest_.time, better.position, kReachMargin_m};
    monitor_.moved();
    return;
  }
  NavState at_end = newest_.state;
  at_end.velocity = T_new_old.rotation * at_end.velocity;
  at_end.T_map_imu = better;
  StartHypothesis found;
  found.T_map_imu = better * ScanMotion(at_end, bundle.imu).relative_pose(bundle.scan.start);
  found.velocity = at_end.velocity;
  if (!suspect_since_) suspect_since_ = newest_.time;
  kept_.clear();
  kept_.push_back({bundle, newest_});
  start_again(found, sink);
}

/// A trajectory that goes on elsewhere was lost, also where the estimator before was only in doubt.
void Supervised::start_again(const StartHypothesis& found, EstimateSink& sink) {
  if (!stopped_ && newest_.health != Health::lost) left_in_doubt_ = newest_.reason;
  if (!stopped_) stop_estimator(sink);
  const Vector3& p = found.T_map_imu.position;
  unconfirmed_ = {fmt::format("lost at {:.3f} s; the search found the position {:.2f} {:.2f} {:.2f} at {:.3f} s",
                              to_seconds(lost_since_.value_or(*suspect_since_)), p.x(), p.y(), p.z(),
                              to_seconds(kept_.front().bundle.scan.start)),
                  kept_.back().bundle.scan.end};
  reported_ = kept_.back().bundle.scan.end;
  estimator_ = make_(begin_at(found, input_));
  stopped_ = false;
  scans_ = 0;
  good_since_.reset();
  out_of_reach_.reset();
  lost_since_.reset();
  suspect_since_.reset();
  monitor_.restart();
  const std::deque<Kept> kept = std::move(kept_);
  kept_.clear();
  for (const Kept& scan : kept) estimate(scan.bundle, sink);
}

void Supervised::finish(EstimateSink& sink) {
  if (!stopped_) stop_estimator(sink);
}

const CalibrationEstimate* Supervised::calibration() const {
  return best_calibration_ ? &*best_calibration_ : nullptr;
}

}  // namespace lodestone

#include "estimators/health/supervised.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/error.h"

namespace lodestone {

namespace {

constexpr double kConfirmed_s = 1.0;     // of being lost, before the estimator is stopped
constexpr double kFirstSearch_s = 1.5;   // of data
constexpr double kLongestWait_s = 60.0;  // between two searches that found nothing

/// A lost estimator whose state contradicts the maps only gets worse.
bool is_wrong(HealthReason reason) {
  return reason != HealthReason::covariance && reason != HealthReason::none;
}

}  // namespace

/// Judges estimates on their way to another sink. Estimates of times that were reported before are dropped.
class Supervised::JudgingSink final : public EstimateSink {
 public:
  /// `bundle`: that of the causal estimate; null once no more scans are processed.
  JudgingSink(Supervised& owner, const ScanBundle* bundle, Time reported, EstimateSink& sink)
      : owner_(owner), bundle_(bundle), reported_(reported), sink_(sink) {}

  void causal(const Estimate& estimate) override {
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

Supervised::Supervised(EstimatorInput input, Make make)
    : input_(std::move(input)),
      make_(std::move(make)),
      estimator_(make_(input_)),
      monitor_(input_),
      searchable_(input_.planes != nullptr && input_.linearize_at == nullptr) {}

Supervised::~Supervised() = default;

void Supervised::process(const ScanBundle& bundle, EstimateSink& sink) {
  if (stopped_) {
    report_lost(bundle, sink);
  } else {
    estimate(bundle, sink);
    const bool lost = newest_.health == Health::lost;
    if (!lost) {
      lost_since_ = 0;
      kept_.clear();
      return;
    }
    if (lost_since_ == 0) {
      lost_since_ = bundle.scan.end;
      next_search_s_ = kFirstSearch_s;
      wait_s_ = kFirstSearch_s;
    }
    if (!searchable_) return;
    if (is_wrong(newest_.reason) && to_seconds(bundle.scan.end - lost_since_) >= kConfirmed_s) stop_estimator(sink);
  }
  if (!searchable_) return;
  keep(bundle);
  if (const std::optional<StartHypothesis> found = search()) start_again(*found, sink);
}

void Supervised::estimate(const ScanBundle& bundle, EstimateSink& sink) {
  JudgingSink judging(*this, &bundle, reported_, sink);
  estimator_->process(bundle, judging);
  ++scans_;
}

void Supervised::report_lost(const ScanBundle& bundle, EstimateSink& sink) {
  Estimate unknown;
  unknown.time = bundle.scan.end;
  unknown.state = newest_.state;
  unknown.covariance = Matrix6::Identity() * 1e6;
  unknown.health = Health::lost;
  unknown.reason = HealthReason::searching;
  sink.causal(unknown);
  if (input_.options.smoother.refine != Refinement::none) sink.smoothed(unknown);
  sink.best(unknown);
}

void Supervised::stop_estimator(EstimateSink& sink) {
  JudgingSink judging(*this, nullptr, reported_, sink);
  estimator_->finish(judging);
  stopped_ = true;
  if (estimator_->calibration() != nullptr && scans_ > best_scans_) {
    best_calibration_ = *estimator_->calibration();
    best_scans_ = scans_;
  }
}

void Supervised::keep(const ScanBundle& bundle) {
  kept_.push_back(bundle);
  while (to_seconds(kept_.back().scan.end - kept_.front().scan.start) > input_.options.search.data_s) kept_.pop_front();
}

std::optional<StartHypothesis> Supervised::search() {
  const double data_s = to_seconds(kept_.back().scan.end - lost_since_);
  if (data_s < next_search_s_) return std::nullopt;
  wait_s_ = std::min(2.0 * wait_s_, kLongestWait_s);
  next_search_s_ = data_s + wait_s_;
  try {
    if (finder_ == nullptr) finder_ = std::make_unique<StartFinder>(input_);
    const std::vector<ScanBundle> bundles(kept_.begin(), kept_.end());
    FoundStart found = finder_->find(bundles);
    if (found.sure) return found.best.front();
  } catch (const InputError&) {
    // No scan with points, or a map without a floor.
  }
  return std::nullopt;
}

void Supervised::start_again(const StartHypothesis& found, EstimateSink& sink) {
  EstimatorInput input = input_;
  input.initial_pose = found.T_map_imu;
  input.initial_velocity = found.velocity;
  if (!stopped_) stop_estimator(sink);
  if (input_.warnings != nullptr) {
    const Vector3& p = found.T_map_imu.position;
    input_.warnings->add(
        "run.found_again",
        fmt::format("lost at {:.3f} s; the search found the position {:.2f} {:.2f} {:.2f} at {:.3f} s",
                    to_seconds(lost_since_), p.x(), p.y(), p.z(), to_seconds(kept_.front().scan.start)),
        kept_.back().scan.end);
  }
  reported_ = kept_.back().scan.end;
  estimator_ = make_(input);
  stopped_ = false;
  scans_ = 0;
  lost_since_ = 0;
  monitor_.restart();
  const std::deque<ScanBundle> bundles = std::move(kept_);
  kept_.clear();
  for (const ScanBundle& bundle : bundles) estimate(bundle, sink);
}

void Supervised::finish(EstimateSink& sink) {
  if (!stopped_) stop_estimator(sink);
}

const CalibrationEstimate* Supervised::calibration() const {
  return best_calibration_ ? &*best_calibration_ : nullptr;
}

}  // namespace lodestone

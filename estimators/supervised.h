#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <optional>

#include "estimators/estimator.h"
#include "estimators/health/health_monitor.h"
#include "estimators/initialization/start_finder.h"

namespace lodestone {

/// Any estimator, with the health of its estimates and a new initialization after it was lost: the search of
/// `--initial-pose auto` on the scans since then (docs/design/050-health.md). The search begins as soon as scans or
/// readings contradict the maps. An estimator at a wrong place is stopped after some seconds; one that merely does not
/// know enough is continued until the search is certain of another place.
class Supervised final : public Estimator {
 public:
  using Make = std::function<std::unique_ptr<Estimator>(const EstimatorInput&)>;

  Supervised(EstimatorInput input, Reckoning reckoning, Make make);
  ~Supervised() override;

  void process(const ScanBundle& bundle, EstimateSink& sink) override;
  void finish(EstimateSink& sink) override;
  std::string solver() const override { return estimator_->solver(); }

  /// Of the estimator that processed the most scans.
  const CalibrationEstimate* calibration() const override;

 private:
  class JudgingSink;

  struct Kept {
    ScanBundle bundle;
    Estimate causal;
  };

  /// A place that a search found; the estimator that began there was not good yet.
  struct FoundPlace {
    std::string what;
    Time time;
  };

  /// Where the robot was at a time, with the distance from there that is possible at that time.
  struct Seen {
    Time time;
    Vector3 position;
    double radius_m;
  };

  void estimate(const ScanBundle& bundle, EstimateSink& sink);
  void report_lost(const ScanBundle& bundle, HealthReason reason, EstimateSink& sink);
  void stop_estimator(EstimateSink& sink);
  void suspect(Time now);
  void keep(const ScanBundle& bundle);
  std::optional<StartHypothesis> search();
  std::vector<Pose> supposed() const;
  bool is_within_reckoning(const StartHypothesis& found) const;
  bool believes(const StartHypothesis& found);
  bool confirms_estimator(const StartHypothesis& found) const;
  bool outweighs_estimator(const StartHypothesis& found);
  void move_nearby(const ScanBundle& bundle, const Pose& better, EstimateSink& sink);
  void start_again(const StartHypothesis& found, EstimateSink& sink);
  void settle_search(const char* kind, const char* outcome);

  EstimatorInput input_;
  Make make_;
  std::unique_ptr<Estimator> estimator_;
  bool stopped_ = false;  // the estimator was lost, and has handed out its estimates
  std::int64_t scans_ = 0;
  HealthMonitor monitor_;
  Estimate newest_;  // causal
  std::optional<Time> good_since_;
  std::optional<Seen> last_good_;      // after some seconds of good estimates
  double fastest_m_s_ = 0.0;           // of these
  std::optional<Seen> out_of_reach_;   // found by a search, too far from the last good estimate
  Time reported_ = -1;                 // estimates up to then were reported by an estimator before this one
  std::optional<Time> suspect_since_;  // lost, or contradicted by the maps
  std::optional<Time> lost_since_;
  Time last_suspect_ = 0;
  std::deque<Kept> kept_;  // of the suspicion, as many as a search looks at
  Time next_search_ = 0;
  double wait_s_ = 0.0;  // between the next search and the one after it
  std::unique_ptr<StartFinder> finder_;
  std::optional<FoundPlace> unconfirmed_;
  std::optional<HealthReason> left_in_doubt_;  // the estimator before was not lost; the next scan says that it was left
  bool searchable_;
  std::optional<CalibrationEstimate> best_calibration_;  // of estimators before this one
  std::int64_t best_scans_ = 0;
};

}  // namespace lodestone

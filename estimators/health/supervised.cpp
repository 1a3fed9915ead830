#include "estimators/health/supervised.h"

namespace lodestone {

namespace {

class JudgingSink final : public EstimateSink {
 public:
  JudgingSink(const ScanBundle& bundle, PlaceJudge& judge, EstimateSink& sink)
      : bundle_(bundle), judge_(judge), sink_(sink) {}
  void causal(const Estimate& estimate) override {
    Estimate judged = estimate;
    const PlaceEvidence evidence = judge_.judge(bundle_, estimate.state);
    judged.diagnostics.place_share = evidence.scan_share;
    judged.diagnostics.decoy_share = evidence.decoy_share;
    judged.diagnostics.place_points = evidence.scan_points;
    judged.diagnostics.field_odds = evidence.field_odds;
    sink_.causal(judged);
  }
  void best(const Estimate& estimate) override { sink_.best(estimate); }
  void smoothed(const Estimate& estimate) override { sink_.smoothed(estimate); }

 private:
  const ScanBundle& bundle_;
  PlaceJudge& judge_;
  EstimateSink& sink_;
};

}  // namespace

void Supervised::process(const ScanBundle& bundle, EstimateSink& sink) {
  JudgingSink judging(bundle, judge_, sink);
  estimator_->process(bundle, judging);
}

}  // namespace lodestone

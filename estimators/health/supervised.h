#pragma once

#include <memory>

#include "estimators/estimator.h"
#include "estimators/health/place_evidence.h"

namespace lodestone {

/// Any estimator, whose estimates are compared with the maps.
class Supervised final : public Estimator {
 public:
  Supervised(std::unique_ptr<Estimator> estimator, EstimatorInput input)
      : estimator_(std::move(estimator)), input_(std::move(input)), judge_(input_) {}

  void process(const ScanBundle& bundle, EstimateSink& sink) override;
  void finish(EstimateSink& sink) override { estimator_->finish(sink); }
  std::string solver() const override { return estimator_->solver(); }
  const CalibrationEstimate* calibration() const override { return estimator_->calibration(); }

 private:
  std::unique_ptr<Estimator> estimator_;
  EstimatorInput input_;
  PlaceJudge judge_;
};

}  // namespace lodestone

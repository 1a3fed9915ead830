#pragma once

#include "core/random_stream.h"
#include "estimators/baselines/field_matching.h"
#include "estimators/baselines/magnetic_stochastic/stochastic_options.h"
#include "estimators/baselines/state_cloud.h"

namespace lodestone {

/// Magnetic localization by stochastic optimization, after IDF-MFL (docs/design/054-magnetic-stochastic.md): for each
/// scan, the Gaussian distribution of heading and position that minimizes the expected outlier-robust matching cost,
/// found by sampling. The IMU predicts, and the wheels where the log has them.
class MagneticStochasticFilter final : public Estimator {
 public:
  /// `input` must have a field map. Cloud map and scans are not used.
  MagneticStochasticFilter(EstimatorInput input, const StochasticOptions& options);

  void process(const ScanBundle& bundle, EstimateSink& sink) override;
  void finish(EstimateSink& sink) override;

 private:
  void match(const MatchedScan& scan);

  EstimatorInput input_;
  StochasticOptions options_;
  FieldMatching matching_;
  RandomStream random_;
  bool started_ = false;
  StateCloud cloud_;  // of one state
};

}  // namespace lodestone

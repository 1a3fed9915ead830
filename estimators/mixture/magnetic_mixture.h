#pragma once

#include <deque>

#include "estimators/baselines/field_matching.h"
#include "estimators/mixture/place_past.h"

namespace lodestone {

/// Localization on a field map that follows several places (PlaceMixture). The best estimate of a scan is chosen and
/// smoothed with the readings of at least 20 s after it (PlacePast).
class MagneticMixture final : public Estimator {
 public:
  /// `input` must have a field map and magnetometers. Cloud map and scans are not used.
  explicit MagneticMixture(EstimatorInput input);

  void process(const ScanBundle& bundle, EstimateSink& sink) override;
  void finish(EstimateSink& sink) override;

 private:
  /// Of places and their weights: the mean of those near the heaviest one, and the second moment of all about it.
  /// The array's clock is no state: its sigma is added along the velocity.
  void set_estimate(std::span<const PlaceComponent> places, Estimate& estimate) const;
  /// Reports the oldest scans, `count` of them, smoothed with the scans up to `last`.
  void report(std::size_t count, std::size_t last, EstimateSink& sink);

  EstimatorInput input_;
  FieldMatching matching_;
  PlaceMixture mixture_;
  PlacePast past_;
  std::deque<Estimate> causal_;  ///< of the scans in `past_`
};

}  // namespace lodestone

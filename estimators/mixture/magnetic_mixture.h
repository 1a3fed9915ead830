#pragma once

#include <deque>

#include "estimators/baselines/field_matching.h"
#include "estimators/mixture/place_mixture.h"

namespace lodestone {

/// Localization on a field map that follows several places (PlaceMixture). The best estimate of a scan is chosen with
/// the readings of the 20 s after it: of the places at that scan, those from which the heaviest ones of today come.
class MagneticMixture final : public Estimator {
 public:
  /// `input` must have a field map and magnetometers. Cloud map, scans and wheels are not used.
  explicit MagneticMixture(EstimatorInput input);

  void process(const ScanBundle& bundle, EstimateSink& sink) override;
  void finish(EstimateSink& sink) override;

 private:
  struct Place {
    NavState state;
    Matrix6 covariance = Matrix6::Zero();
    std::size_t parent = 0;
  };
  struct Moment {
    Estimate causal;
    std::vector<Place> places;
  };

  /// Of these places with these weights: the mean of those near the heaviest one, and the second moment of all about
  /// it.
  static void set_estimate(const std::vector<Place>& places, const std::vector<double>& weights, Estimate& estimate);
  /// Reports the oldest moment.
  void report(EstimateSink& sink);

  EstimatorInput input_;
  FieldMatching matching_;
  PlaceMixture mixture_;
  std::deque<Moment> moments_;
  std::vector<double> weights_;  ///< of the newest moment's places
};

}  // namespace lodestone

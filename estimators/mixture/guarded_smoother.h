#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <optional>

#include "estimators/mixture/magnetic_mixture.h"

namespace lodestone {

/// A smoother on a field map alone. Its window follows one place; a MagneticMixture beside it follows all that fit.
/// Where the two contradict each other, the estimate is the mixture's, and a window that was at a wrong place begins
/// again at the mixture's (docs/design/060-places-as-a-mixture.md).
class GuardedSmoother final : public Estimator {
 public:
  using Make = std::unique_ptr<Estimator> (*)(EstimatorInput input);

  /// `input`: as for MagneticMixture. `make` makes the smoother.
  GuardedSmoother(EstimatorInput input, Make make);

  void process(const ScanBundle& bundle, EstimateSink& sink) override;
  void finish(EstimateSink& sink) override;
  std::string solver() const override { return smoother_->solver(); }

  /// None if a window was at a wrong place.
  const CalibrationEstimate* calibration() const override;

 private:
  class PlaceSink;
  class WindowSink;

  /// Estimates of the same scans by mixture and window, until both are known.
  struct Pairs {
    std::deque<Estimate> places;
    std::deque<Estimate> windows;
  };
  using Emit = void (EstimateSink::*)(const Estimate&);
  void report(Pairs& pairs, Emit emit, EstimateSink& sink);
  void report(EstimateSink& sink);
  void begin_again(EstimateSink& sink);

  EstimatorInput input_;
  Make make_;
  std::unique_ptr<Estimator> smoother_;
  MagneticMixture mixture_;
  Estimate newest_place_;
  Estimate newest_window_;
  Pairs best_;
  Pairs smoothed_;  ///< if the run is refined at the end of the log
  bool wrong_place_ = false;
  Time begun_ = -1;  ///< of the window, if it began again
};

/// Whether the window's position is not one that the mixture expects, or far surer than the mixture, which then knows
/// several places.
bool contradicts(const Estimate& window, const Estimate& place);

}  // namespace lodestone

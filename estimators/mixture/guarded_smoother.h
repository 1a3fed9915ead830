#pragma once

#include <deque>
#include <memory>
#include <optional>

#include "estimators/mixture/magnetic_mixture.h"

namespace lodestone {

/// A smoother on a field map alone. Its window follows one place; a MagneticMixture beside it follows all that fit. An
/// estimate of the window that the mixture does not expect is replaced by the mixture's. A window that differs from the
/// mixture for longer than the mixture's lag begins again at the mixture's place
/// (docs/design/061-a-smoother-guarded-by-a-mixture.md).
class GuardedSmoother final : public Estimator {
 public:
  using Make = std::unique_ptr<Estimator> (*)(EstimatorInput input);

  /// `input`: as for MagneticMixture. `make` makes the smoother.
  GuardedSmoother(EstimatorInput input, Make make);

  void process(const ScanBundle& bundle, EstimateSink& sink) override;
  void finish(EstimateSink& sink) override;
  std::string solver() const override { return smoother_->solver(); }

  /// None if the window began again, or was at a wrong place at the end.
  const CalibrationEstimate* calibration() const override;

 private:
  class PlaceSink;
  class WindowSink;

  /// Estimates of the same scans by mixture and window, each scan once, until both are known.
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
  Pairs smoothed_;                       ///< if the run is refined at the end of the log
  std::optional<Time> elsewhere_since_;  ///< the causal estimates: the window is not at the mixture's place
  std::optional<Time> was_elsewhere_;    ///< of the newest pair whose place is sure
  Time begun_ = -1;                      ///< of the window, if it began again
};

/// Whether two estimates of a state by the same readings differ by more than both covariances allow, or one of them is
/// unsure where the other is far surer.
bool differ(const Estimate& window, const Estimate& place);

/// Whether the mixture's estimate is to be reported instead of the window's: they differ, or the window's pose is
/// beyond the mixture's covariance. The distance between an efficient estimate and another one by the same readings has
/// at most the other's covariance (Hausman, Econometrica 1978).
bool is_replaced(const Estimate& window, const Estimate& place);

}  // namespace lodestone

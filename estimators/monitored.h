#pragma once

#include <memory>
#include <utility>

#include "core/magnetometer/magnetometer_monitor.h"
#include "estimators/estimator.h"

namespace lodestone {

/// Decorates an estimator with a monitor of the magnetometers, which rejects invalid readings before the estimator
/// processes them.
class Monitored final : public Estimator {
 public:
  Monitored(std::unique_ptr<Estimator> estimator, const SensorSuite& suite, WarningLog* warnings)
      : estimator_(std::move(estimator)), monitor_(suite, warnings) {}

  void process(const ScanBundle& bundle, EstimateSink& sink) override {
    auto healthy = monitor_.without_unhealthy(bundle.magnetic, bundle.scan.end);
    if (!healthy) return estimator_->process(bundle, sink);
    ScanBundle clean = bundle;
    clean.magnetic = std::move(*healthy);
    estimator_->process(clean, sink);
  }

  /// Does not copy the cloud, even if a reading is rejected.
  void process_in_place(ScanBundle& bundle, EstimateSink& sink) override {
    auto healthy = monitor_.without_unhealthy(bundle.magnetic, bundle.scan.end);
    if (!healthy) return estimator_->process_in_place(bundle, sink);
    std::swap(bundle.magnetic, *healthy);
    estimator_->process_in_place(bundle, sink);
    std::swap(bundle.magnetic, *healthy);
  }

  void finish(EstimateSink& sink) override { estimator_->finish(sink); }
  std::string solver() const override { return estimator_->solver(); }
  const CalibrationEstimate* calibration() const override { return estimator_->calibration(); }

 private:
  std::unique_ptr<Estimator> estimator_;
  MagnetometerMonitor monitor_;
};

}  // namespace lodestone

#pragma once

#include <memory>
#include <utility>

#include "core/magnetometer/magnetometer_monitor.h"
#include "estimators/estimator.h"

namespace lodestone {

/// Any estimator behind a monitor of the magnetometers: it never sees a reading that cannot be a measurement, and is
/// told nothing else.
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

  /// Without a copy of the cloud, also if a reading is unhealthy.
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

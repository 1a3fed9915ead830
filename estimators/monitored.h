#pragma once

#include <memory>

#include "estimators/estimator.h"
#include "core/magnetometer/magnetometer_monitor.h"

namespace lodestone {

/// Any estimator behind a monitor of the magnetometers: it never sees a reading that cannot be a measurement, and is told
/// nothing else.
class Monitored final : public Estimator {
 public:
  Monitored(std::unique_ptr<Estimator> estimator, const SensorSuite& suite, WarningLog* warnings)
      : estimator_(std::move(estimator)), monitor_(suite, warnings) {}

  void process(const ScanBundle& bundle, EstimateSink& sink) override {
    cleaned(bundle, [&](const ScanBundle& clean) { estimator_->process(clean, sink); });
  }

  void finish(EstimateSink& sink) override { estimator_->finish(sink); }
  std::string solver() const override { return estimator_->solver(); }

  void save(StateWriter& state, StateWriter& lasting) override { estimator_->save(state, lasting); }
  void load(StateReader& state, StateReader& lasting) override { estimator_->load(state, lasting); }

  /// The monitor looks at the readings again and so comes to where it was.
  void recall(const ScanBundle& bundle) override {
    cleaned(bundle, [&](const ScanBundle& clean) { estimator_->recall(clean); });
  }

 private:
  template <class Use>
  void cleaned(const ScanBundle& bundle, Use use) {
    auto healthy = monitor_.without_unhealthy(bundle.magnetic, bundle.scan.end);
    if (!healthy) return use(bundle);
    ScanBundle clean = bundle;
    clean.magnetic = std::move(*healthy);
    use(clean);
  }

  std::unique_ptr<Estimator> estimator_;
  MagnetometerMonitor monitor_;
};

}  // namespace lodestone

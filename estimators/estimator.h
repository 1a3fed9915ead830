#pragma once

#include <memory>
#include <string>

#include "core/geometry/pose.h"
#include "core/measurements.h"
#include "estimators/estimate.h"
#include "factors/calibration_estimate.h"

namespace lodestone {

/// Receives estimates as they become final. Knows nothing of sources or estimators.
class EstimateSink {
 public:
  virtual ~EstimateSink() = default;

  /// The newest state, once a scan, in order of time: what a robot would have known then.
  virtual void causal(const Estimate& estimate) = 0;

  /// The best estimate of this run for that time, once a scan, in order of time. A filter reports the causal one.
  virtual void best(const Estimate& estimate) = 0;

  /// The window's estimate, once a scan, in order of time, of a run that refines it at the log's end: then `best` comes
  /// after all of these.
  virtual void smoothed(const Estimate& /*estimate*/) {}
};

/// One localization method. The caller feeds bundles in order of time and calls finish once at the end.
class Estimator {
 public:
  virtual ~Estimator() = default;

  /// One scan with its IMU and field samples. Deterministic: the same bundles give the same bits.
  virtual void process(const ScanBundle& bundle, EstimateSink& sink) = 0;

  /// The same for a caller that owns the bundle. The bundle may be changed meanwhile, which avoids copies of its cloud;
  /// it is as before when this returns.
  virtual void process_in_place(ScanBundle& bundle, EstimateSink& sink) { process(bundle, sink); }

  /// Hands out what still lies in the window.
  virtual void finish(EstimateSink& sink) = 0;

  /// The library and the linear solver that minimize this method's cost; empty if it minimizes none.
  virtual std::string solver() const { return {}; }

  /// What the log said of the calibration, once finished; null: this method does not estimate it.
  virtual const CalibrationEstimate* calibration() const { return nullptr; }
};

}  // namespace lodestone

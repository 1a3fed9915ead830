#pragma once

#include <memory>
#include <string>

#include "core/geometry/pose.h"
#include "core/measurements.h"
#include "estimators/estimate.h"
#include "factors/calibration_estimate.h"

namespace lodestone {

/// Receives estimates as they become final. Independent of sources and estimators.
class EstimateSink {
 public:
  virtual ~EstimateSink() = default;

  /// The newest state, once per scan, in order of time, estimated from past measurements only.
  virtual void causal(const Estimate& estimate) = 0;

  /// The best estimate of this run for that time, once per scan, in order of time. For a filter: the causal estimate.
  virtual void best(const Estimate& estimate) = 0;

  /// The window's estimate, once per scan, in order of time. Called only if the run is refined at the end of the log;
  /// `best` is then called after all of these.
  virtual void smoothed(const Estimate& /*estimate*/) {}
};

/// One localization method. The caller feeds bundles in order of time and calls finish once at the end.
class Estimator {
 public:
  virtual ~Estimator() = default;

  /// Processes one scan with its IMU and field samples. Deterministic: the same bundles give bit-identical estimates.
  virtual void process(const ScanBundle& bundle, EstimateSink& sink) = 0;

  /// As `process`, but may modify the bundle during the call, which avoids a copy of the cloud. The bundle is unchanged
  /// on return.
  virtual void process_in_place(ScanBundle& bundle, EstimateSink& sink) { process(bundle, sink); }

  /// Moves what is estimated of the place, and keeps what is estimated of the motion and the calibration: the scans fit
  /// elsewhere. False, and without effect, if this method cannot; it is then initialized anew.
  virtual bool move(const Pose& /*T_new_old*/) { return false; }

  /// Reports the estimates that remain in the window.
  virtual void finish(EstimateSink& sink) = 0;

  /// The library and the linear solver that minimize this method's cost; empty if it minimizes none.
  virtual std::string solver() const { return {}; }

  /// The estimated calibration; valid after finish. Null: this method does not estimate a calibration.
  virtual const CalibrationEstimate* calibration() const { return nullptr; }
};

}  // namespace lodestone

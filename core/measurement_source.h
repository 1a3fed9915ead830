#pragma once

#include "core/measurements.h"

namespace lodestone {

/// A source of measurements: a log reader or the simulator. Sources stream: memory does not grow with the log. Sources
/// do not know estimators.
class MeasurementSource {
 public:
  virtual ~MeasurementSource() = default;

  /// The next measurement in the log's order; false at the end. Throws InputError if the log is unusable.
  virtual bool next(Measurement& measurement) = 0;

  /// First and last stamp of the log, for progress; equal if unknown.
  virtual Time begin_time() const = 0;
  virtual Time end_time() const = 0;
};

}  // namespace lodestone

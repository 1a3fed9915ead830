#pragma once

#include <functional>
#include <vector>

#include "core/evaluation/array_log.h"
#include "core/measurement_source.h"
#include "core/sensor_suite.h"
#include "core/warnings.h"

namespace lodestone {

/// A log's magnetometers, thinned, and its IMU in full.
struct RecordedArray {
  ArrayLog readings;
  std::vector<ImuSample> imu;  ///< in order of time; empty where the source has none
};

/// Reads `source` to its end. Readings that cannot be measurements (stuck, at a limit, spikes) are left out and counted
/// in `warnings` (MagnetometerMonitor). `progress` is called with each measurement's time.
RecordedArray record_array(MeasurementSource& source, const SensorSuite& suite, WarningLog& warnings,
                           const std::function<void(Time)>& progress = {});

}  // namespace lodestone

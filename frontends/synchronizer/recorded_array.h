#pragma once

#include <functional>
#include <vector>

#include "core/evaluation/array_log.h"
#include "core/measurement_source.h"
#include "core/sensor_suite.h"
#include "core/warnings.h"

namespace lodestone {

/// The magnetometer readings of a log, thinned, and all IMU samples.
struct RecordedArray {
  ArrayLog readings;
  std::vector<ImuSample> imu;  ///< in order of time; empty if the source has none
};

/// Reads `source` to its end. Invalid readings (stuck, at a limit, spikes) are rejected and counted in `warnings`
/// (MagnetometerMonitor). `progress` is called with each measurement's time.
RecordedArray record_array(MeasurementSource& source, const SensorSuite& suite, WarningLog& warnings,
                           const std::function<void(Time)>& progress = {});

}  // namespace lodestone

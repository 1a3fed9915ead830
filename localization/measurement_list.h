#pragma once

#include <cstddef>
#include <vector>

#include "core/measurement_source.h"
#include "core/sensor_suite.h"

namespace lodestone {

/// Measurements in memory, for localize. Their order is that of their completion times (core/measurements.h); scans of
/// several LiDARs must be merged already (LidarPoint::lidar). Calibrations and clock offsets of a platform file belong
/// to its log reader and are not applied.
class MeasurementList final : public MeasurementSource {
 public:
  /// `measurements`: in any order. Throws InputError for a value that is not finite, an index of a magnetometer or
  /// LiDAR that `suite` lacks, a scan that ends before its start or has a point outside of its time, stamps below 0 or
  /// beyond `farthest_time`, and equal stamps of one sensor.
  MeasurementList(std::vector<Measurement> measurements, const SensorSuite& suite);

  bool next(Measurement& measurement) override;
  Time begin_time() const override;
  Time end_time() const override;

 private:
  std::vector<Measurement> measurements_;
  std::size_t next_ = 0;
};

}  // namespace lodestone

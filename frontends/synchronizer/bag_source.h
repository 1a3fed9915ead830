#pragma once

#include <memory>
#include <string>

#include "core/measurement_source.h"
#include "core/warnings.h"
#include "frontends/configuration/platform.h"
#include "frontends/configuration/sensor_choice.h"

namespace lodestone {

/// Measurements of a log of any kind that open_log() knows, in the order of recording; one message in memory at a time.
/// Scans come as PointCloud2 or as Livox' CustomMsg; those of several LiDARs are merged (scan_merger.h). IMU and
/// magnetometers may lie in messages of any type, several in one (logs/message_paths.h).
///
/// Wrong input that spoils a run is an InputError at construction: a missing or truncated file, a topic that is not
/// there (with those that are), a cloud without per-point time, an IMU in g, a magnetometer in another unit than
/// the platform says, sensors whose clocks differ. What a run survives is dropped or passed on, and counted in
/// `warnings`: lidar.nan_points, lidar.empty_scan, lidar.packed_points, lidar.told_from_content, lidar.clock_jump,
/// lidar.unmerged_points, magnetometer.magnitude, and for lidar, imu and magnetometer
/// PART.stamp_back, PART.stamp_repeated, PART.stamp_jump and PART.not_finite (all dropped), and imu.gap.
class BagSource : public MeasurementSource {
 public:
  /// `warnings` must outlive this.
  BagSource(const std::string& path, const Platform& platform, WarningLog& warnings, SensorChoice choice = {});
  ~BagSource() override;

  bool next(Measurement& measurement) override;
  Time begin_time() const override;
  Time end_time() const override;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace lodestone

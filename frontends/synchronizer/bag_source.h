#pragma once

#include <memory>
#include <string>

#include "core/measurement_source.h"
#include "core/warnings.h"
#include "frontends/configuration/platform.h"
#include "frontends/configuration/sensor_choice.h"

namespace lodestone {

/// What a pause of the log, over a minute without data of any sensor, means to the reader.
enum class LogPause {
  ends_the_log,  ///< the motion within the pause is unknown
  is_bridged     ///< the poses are known
};

/// Measurements of a log in any format of open_log(), in the order of recording; only one message is in memory at a
/// time. Scans are PointCloud2 or Livox' CustomMsg; those of several LiDARs are merged (scan_merger.h). Data of IMU and
/// magnetometers may be in messages of any type, several in one message (logs/message_paths.h).
///
/// Errors that spoil a run throw InputError at construction: a missing or truncated file, a missing topic (the message
/// lists the topics), a cloud without per-point time, an IMU in g, a magnetometer in another unit than in the platform
/// file, sensors with different clocks. Other errors are counted in `warnings`: lidar.nan_points, lidar.far_points,
/// lidar.empty_scan, lidar.packed_points, lidar.told_from_content, lidar.clock_jump, lidar.unmerged_points,
/// magnetometer.magnitude, imu.gap; and for lidar, imu, magnetometer and wheels PART.stamp_back, PART.stamp_repeated,
/// PART.stamp_jump and PART.not_finite, whose data are discarded.
class BagSource : public MeasurementSource {
 public:
  /// `warnings` must outlive this.
  BagSource(const std::string& path, const Platform& platform, WarningLog& warnings, SensorChoice choice = {},
            LogPause pause = LogPause::ends_the_log);
  ~BagSource() override;

  bool next(Measurement& measurement) override;
  Time begin_time() const override;
  Time end_time() const override;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace lodestone

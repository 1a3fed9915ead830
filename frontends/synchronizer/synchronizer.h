#pragma once

#include <deque>

#include "core/measurement_source.h"
#include "core/sensor_suite.h"
#include "core/warnings.h"
#include "frontends/configuration/sensor_choice.h"
#include "frontends/synchronizer/array_grouping.h"

namespace lodestone {

/// Makes one bundle of each scan: its points, and the IMU and field samples since the previous scan's end
/// (core/measurements.h). Where the LiDAR is silent, and in a run without it, bundles with empty scans follow at the
/// nominal period, so that IMU and field go on. A scan that lasts less than half its period, such as a deskewed one,
/// stands for a whole period before its end. If the log's first scan lasts no time, its bundle has one IMU sample.
///
/// Deterministic, and of constant memory: it holds a scan or two, and about a second of samples.
/// Counted in `warnings`: lidar.before_imu, lidar.after_imu, lidar.late_scan (scans dropped), lidar.silent (empty
/// bundles put in), imu.held (the last sample stands for a missing one), imu.late and magnetometer.late (samples
/// dropped).
class Synchronizer {
 public:
  /// `source` and `warnings` must outlive this. A sensor that is not chosen is not waited for.
  Synchronizer(MeasurementSource& source, const SensorSuite& suite, WarningLog& warnings, SensorChoice choice = {});

  /// The next bundle; false at the end of the log. Throws what the source throws.
  bool next(ScanBundle& bundle);

 private:
  bool pull();
  void add(LidarScan&& scan);
  void add(const ImuSample& sample);
  void add(const MagneticSample& sample);
  bool plan(LidarScan& scan);
  bool plan_empty(Time length, LidarScan& scan) const;
  bool imu_reaches(Time time) const { return !imu_.empty() && imu_.back().time >= time; }
  Time begin_of(const LidarScan& scan) const;
  void wait_for(Time time);
  bool hold_last_imu(const LidarScan& scan);
  bool take_imu(const LidarScan& scan, std::vector<ImuSample>& samples);
  void take_fields(const LidarScan& scan, std::vector<MagneticArraySample>& samples);

  MeasurementSource& source_;
  WarningLog& warnings_;
  SensorChoice choice_;
  Time period_;  ///< of a scan
  Time imu_period_;

  std::deque<LidarScan> scans_;
  std::deque<ImuSample> imu_;   ///< the first lies at or before the previous end
  Time last_measured_imu_ = 0;  ///< held samples are later
  ArrayGrouping fields_;
  Time newest_ = 0;  ///< of all that was pulled
  bool ended_ = false;
  bool started_ = false;
  bool silent_ = false;  ///< the bundle before was an empty one
  Time previous_end_ = 0;
};

}  // namespace lodestone

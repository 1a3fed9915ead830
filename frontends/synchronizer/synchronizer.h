#pragma once

#include <deque>

#include "core/measurement_source.h"
#include "core/sensor_suite.h"
#include "core/warnings.h"
#include "frontends/configuration/sensor_choice.h"
#include "frontends/synchronizer/array_grouping.h"

namespace lodestone {

/// Makes one bundle of each scan: its points, and the IMU and field samples since the previous scan's end
/// (core/measurements.h). If LiDAR is silent, or not used, bundles with empty scans follow at the nominal period, so
/// that IMU and field are still processed. A scan shorter than half its period, such as a deskewed one, stands for a
/// whole period before its end. If the log's first scan has no duration, its bundle has one IMU sample.
///
/// Deterministic, with constant memory: one or two scans and about a second of samples. Counted in `warnings`:
/// lidar.before_imu, lidar.after_imu, lidar.late_scan (discarded scans), lidar.overlap (discarded points from before
/// the previous scan's end), lidar.silent (inserted empty bundles), imu.held (the last sample is repeated for a missing
/// one), imu.late, magnetometer.late and wheels.late (discarded samples).
class Synchronizer {
 public:
  /// `source` and `warnings` must outlive this. Sensors that are not chosen are not waited for.
  Synchronizer(MeasurementSource& source, const SensorSuite& suite, WarningLog& warnings, SensorChoice choice = {});

  /// The next bundle; false at the end of the log. Rethrows the source's exceptions.
  bool next(ScanBundle& bundle);

 private:
  bool pull();
  void add(LidarScan&& scan);
  void add(const ImuSample& sample);
  void add(const MagneticSample& sample);
  void add(const WheelSample& sample);
  bool cut_overlap(LidarScan& scan);
  bool plan(LidarScan& scan);
  bool plan_empty(Time length, LidarScan& scan) const;
  bool imu_reaches(Time time) const { return !imu_.empty() && imu_.back().time >= time; }
  bool is_measured(const ImuSample& sample) const {
    return sample.time != added_imu_ && sample.time <= last_measured_imu_;
  }
  Time begin_of(const LidarScan& scan) const;
  void wait_for(Time time);
  bool hold_last_imu(const LidarScan& scan);
  bool take_imu(ScanBundle& bundle);
  void take_fields(const LidarScan& scan, std::vector<MagneticArraySample>& samples);
  bool wheels_reach(Time time) const { return !choice_.wheels || (!wheels_.empty() && wheels_.back().time >= time); }
  void take_wheels(const LidarScan& scan, std::vector<WheelSample>& samples);

  MeasurementSource& source_;
  WarningLog& warnings_;
  SensorChoice choice_;
  Time period_;  ///< nominal, of a scan
  Time imu_period_;

  std::deque<LidarScan> scans_;
  std::deque<ImuSample> imu_;   ///< the first is at or before the previous end
  Time last_measured_imu_ = 0;  ///< repeated samples are later
  Time taken_imu_ = 0;          ///< newest measured sample in a bundle
  Time added_imu_ = -1;         ///< newest sample in the queue that was interpolated or repeated
  ArrayGrouping fields_;
  std::deque<WheelSample> wheels_;
  Time newest_ = 0;  ///< newest time of all measurements read
  bool ended_ = false;
  bool started_ = false;
  bool silent_ = false;  ///< the previous bundle was empty
  Time previous_end_ = 0;
};

}  // namespace lodestone

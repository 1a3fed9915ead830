#pragma once

#include <vector>

#include "frontends/configuration/sensor_choice.h"
#include "tools/check/finding.h"
#include "tools/check/log_sample.h"
#include "tools/check/scan_odometry.h"

/// All that a log's begin shows without a map.
namespace lodestone {

/// Each sensor by itself: topics, stamps, scans, IMU, magnetometers. Costs hardly more than reading the sample.
/// `needed`: a missing topic of another sensor is but a note.
Findings check_sensors(const LogSample& sample, const Platform& platform, SensorChoice needed = {});

/// Follows the scans of every LiDAR of the sample.
std::vector<ScanOdometry> follow_all_scans(const LogSample& sample, const Platform& platform);

/// Adds to `findings`, those of check_sensors, what IMU and LiDARs say of each other. `odometry`: of follow_all_scans.
void check_motion(const LogSample& sample, const Platform& platform, const std::vector<ScanOdometry>& odometry,
                  Findings& findings);

}  // namespace lodestone

#pragma once

#include <vector>

#include "frontends/configuration/sensor_choice.h"
#include "tools/check/finding.h"
#include "tools/check/log_sample.h"
#include "tools/check/scan_odometry.h"

/// Checks that need no map.
namespace lodestone {

/// Checks each sensor alone: topics, stamps, scans, IMU, magnetometers, wheels, and the stated mountings. Costs little
/// more than reading the sample. `needed`: a missing topic of any other sensor is only a note.
Findings check_sensors(const LogSample& sample, const Platform& platform, SensorChoice needed = {});

/// Scan odometry of every LiDAR of the sample.
std::vector<ScanOdometry> follow_all_scans(const LogSample& sample, const Platform& platform);

/// Compares IMU and LiDARs and adds to `findings`, those of check_sensors. `odometry`: of follow_all_scans.
void check_motion(const LogSample& sample, const Platform& platform, const std::vector<ScanOdometry>& odometry,
                  Findings& findings);

}  // namespace lodestone

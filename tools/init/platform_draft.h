#pragma once

#include <string>
#include <vector>

#include "tools/init/log_survey.h"
#include "tools/init/platform_text.h"

namespace lodestone {

/// Describes the robot of the surveyed logs: one LiDAR, one IMU, all magnetometers. Reads the first `seconds` of IMU
/// and magnetometers of each log for units and noise. Each value that is inferred or guessed has a comment. Throws
/// InputError that lists the topics if there is no IMU, or neither LiDAR nor magnetometers. `imu_noise`: a file that
/// states the noise of the IMU (read_imu_noise); empty: from the log.
CommentedPlatform draft_platform(const LogSurvey& survey, const std::string& name, double seconds,
                                 const std::string& imu_noise = {});

}  // namespace lodestone

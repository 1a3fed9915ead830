#pragma once

#include <string>
#include <vector>

#include "core/sensor_suite.h"

namespace lodestone {

/// An IMU as described for Kalibr.
struct KalibrImu {
  std::string topic;  ///< empty: not stated
  ImuNoise noise;     ///< the two densities and the two random walks; the others are not in such a file
};

/// Reads the noise from an IMU file of Kalibr (imu.yaml, or the result camchain's imu file with a section for each IMU)
/// or of allan_variance_ros: the keys accelerometer_noise_density (m/s²/√Hz), accelerometer_random_walk (m/s³/√Hz),
/// gyroscope_noise_density (rad/s/√Hz), gyroscope_random_walk (rad/s²/√Hz), and rostopic. Other keys are ignored.
/// Throws InputError if the file cannot be read, or a value is missing or not above 0.
std::vector<KalibrImu> read_kalibr_imus(const std::string& path);

/// The IMU of `topic`, or the only one. Throws InputError if there are several, none of them of this topic.
const KalibrImu& imu_of_topic(const std::vector<KalibrImu>& imus, const std::string& topic, const std::string& path);

}  // namespace lodestone

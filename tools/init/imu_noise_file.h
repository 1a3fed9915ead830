#pragma once

#include <string>
#include <vector>

#include "core/sensor_suite.h"

namespace lodestone {

/// The noise of an IMU as a calibration tool states it.
struct StatedImuNoise {
  std::string topic;         ///< empty: not stated
  ImuNoise noise;            ///< the two densities and the two random walks; the others are not in such a file
  bool random_walks = true;  ///< false: the file states none, and those of `noise` are unchanged
};

/// Reads the noise of one or more IMUs from a file of one of these kinds. Other keys are ignored.
///
/// - Kalibr (imu.yaml, or its result with a section for each IMU) and allan_variance_ros:
///   accelerometer_noise_density (m/s²/√Hz), accelerometer_random_walk (m/s³/√Hz), gyroscope_noise_density
///   (rad/s/√Hz), gyroscope_random_walk (rad/s²/√Hz), and rostopic.
/// - imu_utils (NAME_imu_param.yaml): Gyr.avg-axis.gyr_n (rad/s) and Acc.avg-axis.acc_n (m/s²). They are the noise of
///   one sample (its FitAllanGyr::getWhiteNoise multiplies by the root of the rate); divided by √`rate_hz`, they are
///   densities. Its gyr_w and acc_w are bias instabilities, not random walks, and are not used.
///
/// Throws InputError if the file cannot be read, or a value is missing or not above 0.
std::vector<StatedImuNoise> read_imu_noise(const std::string& path, double rate_hz);

/// The IMU of `topic`, or the only one. Throws InputError if there are several, none of them of this topic.
const StatedImuNoise& imu_of_topic(const std::vector<StatedImuNoise>& imus, const std::string& topic,
                                   const std::string& path);

}  // namespace lodestone

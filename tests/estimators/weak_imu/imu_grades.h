#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/sensor_suite.h"
#include "tools/simulate/sensor_options.h"

namespace lodestone::weak_imu {

/// An IMU: the noise of its samples, and the values in the platform file if these differ.
struct ImuGrade {
  std::string name;
  simulation::ImuOptions sensor;
  std::optional<double> stated_gyroscope_density;      ///< rad/s/√Hz
  std::optional<double> stated_accelerometer_density;  ///< m/s²/√Hz

  ImuNoise stated(const ImuNoise& true_noise) const {
    ImuNoise result = true_noise;
    if (stated_gyroscope_density) result.gyroscope_noise_density = *stated_gyroscope_density;
    if (stated_accelerometer_density) result.accelerometer_noise_density = *stated_accelerometer_density;
    return result;
  }
};

inline simulation::ImuOptions imu_sensor(double gyroscope_density, double accelerometer_density, double gyroscope_walk,
                                         double accelerometer_walk, double gyroscope_bias, double accelerometer_bias) {
  simulation::ImuOptions options;
  options.gyroscope_noise_density_rad_s_sqrt_hz = gyroscope_density;
  options.accelerometer_noise_density_m_s2_sqrt_hz = accelerometer_density;
  options.gyroscope_bias_random_walk_rad_s2_sqrt_hz = gyroscope_walk;
  options.accelerometer_bias_random_walk_m_s3_sqrt_hz = accelerometer_walk;
  options.gyroscope_bias_sigma_rad_s = gyroscope_bias;
  options.accelerometer_bias_sigma_m_s2 = accelerometer_bias;
  return options;
}

/// From the best to the worst. Sources: docs/results/weak-imu.md.
inline const std::vector<ImuGrade>& imu_grades() {
  static const std::vector<ImuGrade> grades{
      {"tactical", imu_sensor(4.36e-5, 1.17e-3, 5.7e-8, 1.16e-5, 1.94e-5, 7.4e-3), {}, {}},
      {"industrial", imu_sensor(1.70e-4, 2.0e-3, 1.94e-5, 3.0e-3, 8.7e-3, 0.196), {}, {}},
      {"consumer", imu_sensor(2.62e-4, 2.26e-3, 2.0e-5, 5.0e-4, 0.029, 0.163), {}, {}},
      {"shaken", imu_sensor(1.0e-3, 2.0e-2, 2.0e-5, 5.0e-4, 5.0e-3, 5.0e-2), {}, {}},
      {"weak", imu_sensor(1.0e-2, 1.0, 2.0e-5, 5.0e-4, 5.0e-3, 5.0e-2), {}, {}},
      {"misstated", imu_sensor(2.62e-4, 2.26e-3, 2.0e-5, 5.0e-4, 0.029, 0.163), 1.0e-2, 1.0},
  };
  return grades;
}

}  // namespace lodestone::weak_imu

#pragma once

#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include "core/calibration/magnetometer_calibration.h"
#include "core/evaluation/array_log.h"
#include "core/geometry/trajectory.h"
#include "core/measurements.h"
#include "core/sensor_suite.h"

namespace lodestone::testing {

/// Simulates the log of an array that moves through a field, with a gyroscope.
struct SimulatedArray {
  // Input.
  SensorSuite suite;
  std::vector<MagnetometerCalibration> truth;              ///< one per magnetometer
  std::function<Pose(double)> motion;                      ///< T_map_imu, seconds
  std::function<Vector3(const Vector3&)> field;            ///< µT at a position, map axes
  Vector3 gyroscope_bias = Vector3(0.002, -0.003, 0.004);  ///< rad/s
  double duration_s = 60.0;
  unsigned seed = 1;

  // Output.
  std::vector<MagneticArraySample> samples;
  ArrayLog readings{0};  ///< of the array
  std::vector<ImuSample> imu;
  Trajectory trajectory;

  /// `count` magnetometers in a row with different orientations, 1 µT of noise.
  explicit SimulatedArray(int count) {
    for (int j = 0; j < count; ++j) {
      MagnetometerModel model;
      model.name = "magnetometer_" + std::to_string(j);
      model.T_imu_mag.position = Vector3(0.25 * std::cos(2.1 * j), 0.25 * std::sin(2.1 * j), 0.08 * (j % 2));
      model.T_imu_mag.rotation = so3::exp(Vector3(0.0, 0.0, 1.5707963267948966 * j));
      suite.magnetometers.push_back(model);
    }
    truth.resize(suite.magnetometers.size());
    suite.imu.gyroscope_noise_density = 1e-3;
  }

  void run() {
    constexpr double kImuPeriod_s = 0.005, kFieldPeriod_s = 0.01, kDifference_s = 1e-4;
    std::mt19937_64 generator(seed);
    std::normal_distribution<double> normal;
    const auto noise = [&](double sigma) {
      Vector3 vector;
      for (double& component : vector) component = sigma * normal(generator);
      return vector;
    };
    for (int i = 0; i * kImuPeriod_s <= duration_s; ++i) {
      const double t = i * kImuPeriod_s;
      const Quaternion before = motion(t - kDifference_s).rotation, after = motion(t + kDifference_s).rotation;
      const Vector3 rate = so3::log(before.conjugate() * after) / (2.0 * kDifference_s);
      imu.push_back({from_seconds(t),
                     rate + gyroscope_bias + noise(suite.imu.gyroscope_noise_density / std::sqrt(kImuPeriod_s)),
                     Vector3(0.0, 0.0, 9.8)});
      trajectory.push_back({from_seconds(t), motion(t)});
    }
    readings = ArrayLog(suite.magnetometers.size());
    for (int i = 1; i * kFieldPeriod_s < duration_s; ++i) {
      const Pose T_map_imu = motion(i * kFieldPeriod_s);
      MagneticArraySample sample;
      sample.time = from_seconds(i * kFieldPeriod_s);
      for (std::size_t j = 0; j < truth.size(); ++j) {
        const Pose T_map_mag = T_map_imu * suite.magnetometers[j].T_imu_mag;
        const Vector3 here = T_map_mag.rotation.conjugate() * field(T_map_mag.position);
        const Vector3 reading = truth[j].distortion * here + truth[j].hard_iron_ut;
        sample.field_ut.push_back(Vector3(reading + noise(suite.magnetometers[j].noise_ut)));
      }
      samples.push_back(std::move(sample));
    }
    readings.add(samples);
  }

  /// Draws calibrations from the priors of a calibration.
  void draw_truth(double hard_iron_sigma_ut, double soft_iron_sigma, double misalignment_sigma_rad) {
    std::mt19937_64 generator(1000 + seed);
    std::normal_distribution<double> normal;
    for (MagnetometerCalibration& one : truth) {
      Distortion distortion;
      for (int i = 0; i < 3; ++i) one.hard_iron_ut[i] = hard_iron_sigma_ut * normal(generator);
      for (int i = 0; i < 9; ++i)
        distortion[i] = (i < 6 ? soft_iron_sigma : misalignment_sigma_rad) * normal(generator);
      one.distortion = distortion_matrix(distortion);
    }
  }
};

/// Rotated by hand into all attitudes, about one place.
inline Pose tumbling(double t) {
  const Quaternion yaw = so3::exp(Vector3(0.0, 0.0, 0.8 * t));
  const Quaternion pitch = so3::exp(Vector3(0.0, 1.4 * std::sin(0.53 * t), 0.0));
  const Quaternion roll = so3::exp(Vector3(2.0 * std::sin(0.31 * t + 0.4), 0.0, 0.0));
  return {yaw * pitch * roll, Vector3(0.03 * std::sin(0.7 * t), 0.03 * std::cos(0.5 * t), 1.0)};
}

/// A robot that turns back and forth on a level floor, about one place.
inline Pose turning(double t) {
  return {so3::exp(Vector3(0.0, 0.0, 2.5 * std::sin(0.4 * t))), Vector3(0.02 * std::sin(0.3 * t), 0.0, 0.2)};
}

/// A robot that drives along a corridor.
inline Pose straight(double t) {
  return {Quaternion::Identity(), Vector3(0.5 * t, 0.0, 0.2)};
}

/// The earth's field and that of some steel: dipoles (µT m³), at least one metre from the origin.
inline Vector3 field_with_steel(const Vector3& place) {
  Vector3 field(18.0, 4.0, -42.0);
  const auto add = [&](const Vector3& at, const Vector3& moment) {
    const Vector3 away = place - at;
    const double r = away.norm();
    const Vector3 direction = away / r;
    field += (3.0 * direction.dot(moment) * direction - moment) / (r * r * r);
  };
  add({2.0, 1.5, 0.5}, {10.0, -4.0, 7.0});
  add({-1.5, 2.0, 1.5}, {-5.0, 7.0, 3.0});
  for (int i = 1; i < 12; ++i) {
    add({3.0 * i, i % 2 == 0 ? 2.0 : -2.2, 0.3}, {20.0 * std::sin(1.7 * i), 15.0, 25.0 * std::cos(2.3 * i)});
  }
  return field;
}

inline Vector3 uniform_field(const Vector3&) {
  return {18.0, 4.0, -42.0};
}

}  // namespace lodestone::testing

#pragma once

#include <cmath>
#include <cstdint>
#include <memory>
#include <random>
#include <vector>

#include "core/imu/integration.h"
#include "core/lidar/condensed_cost.h"
#include "core/magnetometer/magnetic_map.h"
#include "core/sensor_suite.h"
#include "factors/field_factor.h"

namespace lodestone {

/// One seeded stream of normal numbers.
class Random {
 public:
  explicit Random(std::uint64_t seed) : generator_(seed) {}
  double normal() { return normal_(generator_); }
  Vector3 vector(double sigma = 1.0) {
    const double x = normal();
    const double y = normal();
    return sigma * Vector3(x, y, normal());
  }
  /// A random pose, with positions of standard deviation `position_m`.
  Pose pose(double position_m = 1.0) {
    const Quaternion rotation = so3::exp(vector());
    return {rotation, vector(position_m)};
  }
  template <int size>
  Eigen::Matrix<double, size, 1> draw(const Eigen::Matrix<double, size, size>& covariance) {
    Eigen::Matrix<double, size, 1> white;
    for (int i = 0; i < size; ++i) white[i] = normal();
    return covariance.llt().matrixL() * white;
  }

 private:
  std::mt19937_64 generator_;
  std::normal_distribution<double> normal_;
};

/// A drive and its IMU samples, drawn from exactly the factors' noise model.
struct Drive {
  std::vector<Time> times;                      ///< of the keyframes
  std::vector<NavState> truth;                  ///< ground truth at the keyframes
  std::vector<std::vector<ImuSample>> samples;  ///< samples[k]: from keyframe k − 1 to k; empty for the first
  std::vector<std::vector<Pose>>
      between;  ///< between[k][i]: T_map_imu, true, at the end of the i-th interval of samples[k]
};

struct DriveOptions {
  int keyframes = 40;
  double period_s = 0.1;                        ///< between keyframes
  int samples = 20;                             ///< IMU intervals between keyframes
  Quaternion heading = Quaternion::Identity();  ///< map from body at the start; the drive goes along body x
  ImuNoise noise;
  double noise_scale = 1.0;
  double turn_scale = 1.0;
};

/// Speed and turn rate vary smoothly. White noise is constant over each interval, and biases walk at keyframes: each
/// interval has its own pair of samples, so that the integration's mean of neighbours does not mix two draws.
inline Drive drive(const DriveOptions& options, Random& random) {
  Drive result;
  NavState state;
  state.T_map_imu.rotation = options.heading;
  state.velocity = options.heading * Vector3(1.0, 0.0, 0.0);
  const double dt = options.period_s / options.samples;
  const double white = options.noise_scale / std::sqrt(dt);
  const double walk = options.noise_scale * std::sqrt(options.period_s);
  Vector3 gyroscope_bias = options.noise_scale * random.vector(1e-3);
  Vector3 accelerometer_bias = options.noise_scale * random.vector(1e-2);
  for (int k = 0; k < options.keyframes; ++k) {
    const Time time = static_cast<Time>(k) * from_seconds(options.period_s);
    std::vector<ImuSample> samples;
    std::vector<Pose> between;
    for (int i = 0; k > 0 && i < options.samples; ++i) {
      const Time start = time - from_seconds(options.period_s) + i * from_seconds(dt);
      const double t = to_seconds(start) + 0.5 * dt;
      const Vector3 turn_rate =
          options.turn_scale * Vector3(0.02 * std::sin(1.7 * t), 0.03 * std::cos(1.1 * t), 0.05 * std::sin(0.9 * t));
      const Vector3 acceleration =
          options.heading * Vector3(0.4 * std::cos(0.8 * t), 0.1 * std::sin(1.3 * t), 0.05 * std::cos(2.0 * t));
      const Quaternion half_turn = so3::exp(0.5 * dt * turn_rate);
      const Vector3 force =
          half_turn.conjugate() * (state.T_map_imu.rotation.conjugate() * (acceleration - state.gravity));
      ImuSample sample{start, turn_rate + gyroscope_bias + random.vector(white * options.noise.gyroscope_noise_density),
                       force + accelerometer_bias + random.vector(white * options.noise.accelerometer_noise_density)};
      samples.push_back(sample);
      sample.time += from_seconds(dt);
      samples.push_back(sample);
      integrate({dt, turn_rate, force}, state.gravity, 1.0, state.T_map_imu, state.velocity);
      between.push_back(state.T_map_imu);
    }
    if (k > 0) {
      gyroscope_bias += random.vector(walk * options.noise.gyroscope_bias_random_walk);
      accelerometer_bias += random.vector(walk * options.noise.accelerometer_bias_random_walk);
    }
    state.gyroscope_bias = gyroscope_bias;
    state.accelerometer_bias = accelerometer_bias;
    result.times.push_back(time);
    result.truth.push_back(state);
    result.samples.push_back(std::move(samples));
    result.between.push_back(std::move(between));
  }
  return result;
}

/// Planes and the points of a scan on them.
struct Scan {
  std::vector<Plane> planes;
  std::vector<Correspondence> matches;  ///< refer to `planes`: a Scan is moved, never copied

  Scan() = default;
  Scan(Scan&&) = default;
  Scan& operator=(Scan&&) = default;
};

/// `points` points at `range_m` around the pose, each on a plane with one of `normals`, with `noise_m` across it. The
/// planes' own normals have errors of `normal_sigma` (rad).
inline Scan scan(const Pose& T_map_imu, const std::vector<Vector3>& normals, int points, double noise_m, double range_m,
                 double normal_sigma, Random& random) {
  Scan result;
  result.planes.resize(static_cast<std::size_t>(points));
  for (std::size_t i = 0; i < result.planes.size(); ++i) {
    const Vector3& normal = normals[i % normals.size()];
    const Vector3 on_plane = T_map_imu.position + random.vector(range_m);
    Vector3 lever = random.vector(0.1);
    lever -= normal.dot(lever) * normal;
    Plane& plane = result.planes[i];
    plane.normal = (normal + random.vector(normal_sigma)).normalized().cast<float>();
    plane.major = Eigen::Vector3f(plane.normal.unitOrthogonal());
    plane.center = (on_plane + lever).cast<float>();
    // From the plane as stored: rounding of the map to float is no sensor noise.
    const Vector3 stored = plane.normal.cast<double>();
    const Vector3 center = plane.center.cast<double>();
    const Vector3 point =
        on_plane + (stored.dot(center - on_plane) / stored.dot(normal)) * normal + noise_m * random.normal() * normal;
    result.matches.push_back(
        {(T_map_imu.inverse() * point).cast<float>(), &plane, static_cast<float>(noise_m * noise_m)});
  }
  return result;
}

inline std::vector<Vector3> room_normals(Random& random) {
  std::vector<Vector3> normals(12);
  for (Vector3& normal : normals) normal = random.vector().normalized();
  return normals;
}

/// A smooth field of 20 to 60 µT over ±`reach_m`.
inline std::shared_ptr<const MagneticMap> wavy_map(double reach_m = 30.0, double resolution_m = 0.25) {
  FieldGrid grid;
  grid.resolution_m = resolution_m;
  grid.origin = {-reach_m, -reach_m};
  grid.columns = grid.rows = static_cast<int>(std::lround(2.0 * reach_m / resolution_m)) + 1;
  grid.heights_m = {0.0};
  std::vector<Eigen::Vector4f> nodes;
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      const double x = grid.origin.x() + grid.resolution_m * column;
      const double y = grid.origin.y() + grid.resolution_m * row;
      nodes.emplace_back(20.0 + 8.0 * std::sin(1.3 * x), 5.0 * std::cos(1.1 * y), -40.0 + 4.0 * std::sin(x + y), 0.5F);
    }
  }
  return std::make_shared<MagneticMap>(grid, nodes, 5.0);
}

/// One reading of each of `biases_ut.size()` magnetometers in a row across the robot.
inline std::vector<FieldReading> field_readings(const Pose& T_map_imu, const MagneticMap& map,
                                                const std::vector<Vector3>& biases_ut, double sigma_ut,
                                                Random& random) {
  std::vector<FieldReading> readings;
  for (std::size_t i = 0; i < biases_ut.size(); ++i) {
    FieldReading reading;
    reading.T_end_mag.position = Vector3(0.3, 0.2 * static_cast<double>(i) - 0.2, -0.1);
    reading.magnetometer = static_cast<int>(i);
    reading.sigma_ut = sigma_ut;
    const auto field = map.query(T_map_imu * reading.T_end_mag.position, FieldInterpolation::bicubic);
    if (!field) continue;
    reading.measured_ut = T_map_imu.rotation.conjugate() * field->field_ut + biases_ut[i] + random.vector(sigma_ut);
    readings.push_back(reading);
  }
  return readings;
}

/// Initial sigmas: φ, p, v, b_g, b_a, g.
inline Matrix17 start_covariance(double scale = 1.0) {
  Vector17 sigma;
  sigma << Vector3::Constant(0.01), Vector3::Constant(0.05), Vector3::Constant(0.1), Vector3::Constant(1e-3),
      Vector3::Constant(0.02), 0.005, 0.005;
  return (scale * sigma).cwiseAbs2().asDiagonal();
}

}  // namespace lodestone

#pragma once

#include <cmath>
#include <memory>
#include <vector>

#include "core/random_stream.h"
#include "estimators/factory.h"

namespace lodestone::testing {

/// A level robot with four magnetometers that drives along x at 1 m/s over a field map. The IMU is nearly exact. The
/// field of the map repeats itself every metre along x up to a place, and is irregular beyond it.
struct StripedField {
  static constexpr double kSpeed_m_s = 1.0;
  static constexpr double kRepeats_until_m = 4.0;
  static constexpr double kHeight_m = 0.2;
  static constexpr double kNoise_ut = 0.5;

  static Vector3 field_ut(double x, double y) {
    const double k = 2.0 * M_PI;
    Vector3 field(20.0 + 8.0 * std::sin(k * x) + 6.0 * std::cos(2.0 * y), 5.0 + 6.0 * std::cos(k * x + y),
                  -40.0 + 7.0 * std::sin(k * x - 3.0 * y));
    if (x > kRepeats_until_m) {
      const double s = x - kRepeats_until_m;
      field += Vector3(9.0 * std::sin(1.7 * s), -7.0 * std::sin(2.3 * s), 8.0 * std::sin(1.1 * s));
    }
    return field;
  }

  explicit StripedField(double until_m = 11.0) {
    FieldGrid grid;
    grid.resolution_m = 0.05;
    grid.origin = {-3.0, -2.0};
    grid.columns = static_cast<int>(std::lround((until_m - grid.origin.x()) / grid.resolution_m)) + 1;
    grid.rows = 81;
    grid.heights_m = {kHeight_m};
    std::vector<Eigen::Vector4f> nodes;
    for (int row = 0; row < grid.rows; ++row) {
      for (int column = 0; column < grid.columns; ++column) {
        nodes.emplace_back();
        nodes.back() << field_ut(grid.origin.x() + grid.resolution_m * column,
                                 grid.origin.y() + grid.resolution_m * row)
                            .cast<float>(),
            0.3F;
      }
    }
    input.field = std::make_shared<MagneticMap>(grid, nodes, 3.0);
    for (const double x : {-0.3, 0.3}) {
      for (const double y : {-0.25, 0.25}) {
        input.suite.magnetometers.push_back({"", {Quaternion::Identity(), {x, y, 0.0}}, kNoise_ut});
      }
    }
    input.suite.calibration = exact_calibration();
    input.initial_pose.position.z() = kHeight_m;
    input.initial_velocity.x() = kSpeed_m_s;
    InitialOptions& initial = input.options.initial;
    initial.velocity_sigma_m_s = 0.05;
    initial.gyroscope_bias_sigma_rad_s = 1e-3;
    initial.accelerometer_bias_sigma_m_s2 = 1e-2;
  }

  /// The robot's true pose; it begins at the origin.
  static Pose truth(Time time) { return {Quaternion::Identity(), {kSpeed_m_s * to_seconds(time), 0.0, kHeight_m}}; }

  /// The drive with the noise of `seed`.
  std::vector<ScanBundle> drive(double duration_s, std::uint64_t seed) const {
    RandomStream random(seed, "readings over stripes");
    std::vector<ScanBundle> bundles;
    constexpr Time kImuPeriod = 5'000'000;
    constexpr Time kScan = 100'000'000;
    const double imu_rate_root = std::sqrt(1.0 / to_seconds(kImuPeriod));
    const auto imu_at = [&](Time time) {
      const ImuNoise& noise = input.suite.imu;
      return ImuSample{time, noise.gyroscope_noise_density * imu_rate_root * random.normal3(),
                       Vector3(0.0, 0.0, input.suite.gravity_m_s2) +
                           noise.accelerometer_noise_density * imu_rate_root * random.normal3()};
    };
    ImuSample last = imu_at(0);
    for (Time begin = 0; to_seconds(begin) < duration_s; begin += kScan) {
      ScanBundle bundle;
      bundle.scan.start = begin;
      bundle.scan.end = begin + kScan;
      bundle.imu.push_back(last);
      for (Time time = begin + kImuPeriod; time <= bundle.scan.end; time += kImuPeriod) {
        bundle.imu.push_back(imu_at(time));
        if (time % (4 * kImuPeriod) != 0) continue;
        MagneticArraySample sample{time, {}};
        for (const MagnetometerModel& magnetometer : input.suite.magnetometers) {
          const Vector3 at = truth(time) * magnetometer.T_imu_mag.position;
          sample.field_ut.emplace_back(field_ut(at.x(), at.y()) + kNoise_ut * random.normal3());
        }
        bundle.magnetic.push_back(sample);
      }
      last = bundle.imu.back();
      bundles.push_back(std::move(bundle));
    }
    return bundles;
  }

  EstimatorInput input;
};

}  // namespace lodestone::testing

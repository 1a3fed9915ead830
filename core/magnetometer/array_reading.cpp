#include "core/magnetometer/array_reading.h"

#include <algorithm>
#include <cmath>

#include "core/angles.h"
#include "core/middle_value.h"

namespace lodestone {

namespace {

constexpr Time kMoment = 5'000'000;  // interval for a velocity: about an IMU's period

/// Largest inflation: at a standstill the map's error remains a bias (docs/design/013-correlated-field-map-error.md).
constexpr double kMostInflation = 40.0;

/// Length of the part at the scan's end whose readings are averaged.
constexpr double kReadingSpan_s = 0.05;

}  // namespace

std::vector<ArrayReading> average_array(std::span<const MagneticArraySample> samples, const ScanMotion& motion,
                                        const SensorSuite& suite, int samples_per_reading) {
  const std::size_t group = static_cast<std::size_t>(std::max(1, samples_per_reading));
  std::vector<ArrayReading> result;
  for (std::size_t begin = 0; begin < samples.size(); begin += group) {
    const auto part = samples.subspan(begin, std::min(group, samples.size() - begin));
    ArrayReading array;
    array.time = part.front().time + (part.back().time - part.front().time) / 2;
    for (std::size_t j = 0; j < suite.magnetometers.size(); ++j) {
      MeanReading reading;
      reading.magnetometer = static_cast<int>(j);
      Time offset_sum = 0;
      for (const MagneticArraySample& sample : part) {
        if (j >= sample.field_ut.size() || !sample.field_ut[j]) continue;
        reading.measured_ut += *sample.field_ut[j];
        offset_sum += sample.time - part.front().time;
        ++reading.samples;
      }
      if (reading.samples == 0) continue;
      reading.measured_ut /= reading.samples;
      const Time time = part.front().time + offset_sum / reading.samples;
      const Pose& T_imu_mag = suite.magnetometers[j].T_imu_mag;
      reading.T_end_mag = motion.relative_pose(time) * T_imu_mag;
      const Pose before = motion.relative_pose(time - kMoment) * T_imu_mag;
      const Pose after = motion.relative_pose(time + kMoment) * T_imu_mag;
      reading.velocity_m_s = (after.position - before.position) / to_seconds(2 * kMoment);
      reading.turn_rad_s = so3::log(before.rotation.conjugate() * after.rotation) / to_seconds(2 * kMoment);
      array.readings.push_back(reading);
    }
    if (!array.readings.empty()) result.push_back(std::move(array));
  }
  return result;
}

double sensor_variance_ut2(const MeanReading& reading, const SensorSuite& suite) {
  const MagnetometerCalibrationSigmas& calibration = suite.calibration.magnetometers;
  const double noise_ut = suite.magnetometers[static_cast<std::size_t>(reading.magnetometer)].noise_ut;
  const double relative = std::hypot(calibration.rotation_sigma_deg * degree, calibration.matrix_sigma);
  return noise_ut * noise_ut / reading.samples + calibration.offset_sigma_ut * calibration.offset_sigma_ut +
         relative * relative * reading.measured_ut.squaredNorm() / 3.0;
}

double correlation_inflation(double spacing_m, double correlation_m) {
  if (correlation_m <= 0.0) return 1.0;
  const double rho = std::exp(-spacing_m / correlation_m);
  return std::min(kMostInflation, (1.0 + rho) / std::max(1.0 - rho, 1e-9));
}

std::optional<ArrayReading> reading_at_end(const ScanBundle& bundle, const NavState& end, const SensorSuite& suite) {
  if (bundle.magnetic.empty()) return std::nullopt;
  const Time earliest = bundle.magnetic.back().time - from_seconds(kReadingSpan_s);
  const auto first = std::find_if(bundle.magnetic.begin(), bundle.magnetic.end(),
                                  [earliest](const MagneticArraySample& sample) { return sample.time >= earliest; });
  const auto count = static_cast<int>(bundle.magnetic.end() - first);
  const std::span<const MagneticArraySample> samples(&*first, static_cast<std::size_t>(count));
  std::vector<ArrayReading> arrays = average_array(samples, ScanMotion(end, bundle.imu), suite, count);
  if (arrays.empty()) return std::nullopt;
  return std::move(arrays.front());
}

Vector3 middle_of(std::span<const Vector3> vectors) {
  Vector3 middle;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    for (const Vector3& vector : vectors) values.push_back(vector[axis]);
    middle[axis] = median(std::move(values));
  }
  return middle;
}

}  // namespace lodestone

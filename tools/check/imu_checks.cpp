#include "tools/check/imu_checks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/angles.h"
#include "frontends/messages/sensor_checks.h"
#include "tools/check/vector_series.h"

namespace lodestone {
namespace {

constexpr double rest_shaking_m_s2 = 0.6;    // more is motion, for any noise
constexpr double gravity_tolerance = 0.03;   // relative; a good accelerometer is within 1 %
constexpr double largest_bias_rad_s = 0.05;  // 3 °/s: above the bias of any suitable gyroscope
constexpr double degrees_bias_rad_s = 0.2;   // a bias of 0.2 °/s, recorded in degrees
constexpr double noise_factor = 8.0;         // relative to the platform file

double white_noise(const std::vector<ImuSample>& imu, std::size_t begin, std::size_t end, Vector3 ImuSample::*value) {
  std::vector<Vector3> values;
  for (std::size_t i = begin; i < end; ++i) values.push_back(imu[i].*value);
  return neighbours_sigma(values);
}

RestSpan describe(const std::vector<ImuSample>& imu, std::size_t begin, std::size_t end) {
  RestSpan span;
  span.begin = imu[begin].time;
  span.end = imu[end - 1].time;
  const auto count = static_cast<double>(end - begin);
  for (std::size_t i = begin; i < end; ++i) {
    span.angular_velocity += imu[i].angular_velocity / count;
    span.linear_acceleration += imu[i].linear_acceleration / count;
  }
  double shaking = 0.0, turning = 0.0;
  for (std::size_t i = begin; i < end; ++i) {
    shaking += (imu[i].linear_acceleration - span.linear_acceleration).squaredNorm() / (3.0 * count);
    turning += (imu[i].angular_velocity - span.angular_velocity).squaredNorm() / (3.0 * count);
  }
  span.shaking_m_s2 = std::sqrt(shaking);
  span.shaking_rad_s = std::sqrt(turning);
  span.gyroscope_noise = white_noise(imu, begin, end, &ImuSample::angular_velocity);
  span.accelerometer_noise = white_noise(imu, begin, end, &ImuSample::linear_acceleration);
  span.at_rest = span.shaking_m_s2 < std::min(rest_shaking_m_s2, 2.0 * span.accelerometer_noise + 0.02) &&
                 span.shaking_rad_s < std::max(2.0 * span.gyroscope_noise, 1e-3);
  return span;
}

class ImuCheck {
 public:
  ImuCheck(const LogSample& sample, const Platform& platform)
      : sample_(sample), platform_(platform), file_(platform.file_name()) {}

  Findings run() {
    const std::optional<RestSpan> rest = calmest_span(sample_.imu);
    if (!rest) return findings_;
    if (refuses_unit()) return findings_;
    check_gravity(*rest);
    if (!in_degrees(*rest)) {
      if (rest->at_rest) check_bias(*rest);
      check_noise(*rest);
    }
    add(Severity::note, rest->at_rest ? "rest" : "no_rest",
        rest->at_rest
            ? fmt::format(
                  "calmest from {:.2f} s on for {:.2f} s, at rest or in straight and even motion: specific force "
                  "{:.3f} m/s2, turn rate {:.3f} deg/s",
                  to_seconds(rest->begin - sample_.imu.front().time), to_seconds(rest->end - rest->begin),
                  rest->linear_acceleration.norm(), rest->angular_velocity.norm() * degrees_per_radian)
            : "the robot never stands still in this part: gravity and biases are less accurate",
        "", rest->begin);
    return findings_;
  }

 private:
  void add(Severity severity, const std::string& what, const std::string& seen, const std::string& change,
           std::optional<Time> time) {
    findings_.push_back({severity, "imu." + what, platform_.imu.topic + ": " + seen, change, time});
  }

  /// Checks the unit of acceleration. True if a run would refuse it.
  bool refuses_unit() {
    FirstReadings readings;
    for (std::size_t i = 0; i < std::min<std::size_t>(200, sample_.imu.size()); ++i) {
      readings.add(sample_.imu[i].time, sample_.imu[i].linear_acceleration.norm());
    }
    try {
      check_acceleration(sample_.path, platform_, readings);
    } catch (const InputError& error) {
      findings_.push_back(error_finding("imu.acceleration_unit", error));
      return true;
    }
    return false;
  }

  void check_gravity(const RestSpan& rest) {
    const double expected = platform_.suite.gravity_m_s2;
    const double found = rest.linear_acceleration.norm();
    if (std::abs(found / expected - 1.0) < (rest.at_rest ? 1.0 : 2.0) * gravity_tolerance) return;
    add(Severity::warning, "gravity",
        fmt::format("the specific force in the calmest part is {:.3f} m/s2; gravity is {:.4g} m/s2", found, expected),
        fmt::format("check gravity_m_s2 and imu.acceleration_unit in {}, or calibrate the accelerometer (scale, bias)",
                    file_),
        rest.begin);
  }

  /// Noise at rest over the noise in the platform file.
  double gyroscope_noise(const RestSpan& rest) const {
    const ImuNoise& model = platform_.suite.imu;
    return rest.gyroscope_noise / (model.gyroscope_noise_density * std::sqrt(model.rate_hz));
  }

  bool noise_is_of_degrees(const RestSpan& rest) const {
    const double ratio = gyroscope_noise(rest);
    return ratio > 0.5 * degrees_per_radian && ratio < 2.0 * degrees_per_radian;
  }

  /// Degrees per second: at rest, the mean turn rate exceeds any gyroscope's bias, and the noise is also that of
  /// degrees.
  bool in_degrees(const RestSpan& rest) {
    const double rate = rest.angular_velocity.norm();
    if (!rest.at_rest || rate < degrees_bias_rad_s || !noise_is_of_degrees(rest)) return false;
    add(Severity::error, "gyroscope_unit",
        fmt::format("at rest, the gyroscope reads {:.3f} rad/s, with {:.0f} times the platform's noise: "
                    "degrees per second",
                    rate, gyroscope_noise(rest)),
        "an Imu message requires rad/s: convert before recording", rest.begin);
    return true;
  }

  void check_bias(const RestSpan& rest) {
    const double rate = rest.angular_velocity.norm();
    if (rate < largest_bias_rad_s) return;
    add(Severity::warning, "gyroscope_bias",
        fmt::format("at rest, the gyroscope reads {:.3f} rad/s ({:.1f} deg/s)", rate, rate * degrees_per_radian),
        rate > degrees_bias_rad_s ? "check the unit: an Imu message requires rad/s, these may be degrees per second"
                                  : "calibrate the gyroscope at rest with its driver",
        rest.begin);
  }

  void check_noise(const RestSpan& rest) {
    const ImuNoise& model = platform_.suite.imu;
    const double root_rate = std::sqrt(model.rate_hz);
    const double gyroscope = gyroscope_noise(rest);
    const double accelerometer = rest.accelerometer_noise / (model.accelerometer_noise_density * root_rate);
    if (gyroscope > noise_factor) {
      add(Severity::warning, "gyroscope_noise",
          fmt::format("the turn rate's noise is {:.2g} rad/s per sample, {:.1f} times that of the platform file",
                      rest.gyroscope_noise, gyroscope),
          fmt::format("{}imu.gyroscope_noise_density_rad_s_sqrt_hz: {:.2g} in {}",
                      noise_is_of_degrees(rest)
                          ? "check the unit: an Imu message requires rad/s, these may be degrees per second; otherwise "
                          : "",
                      rest.gyroscope_noise / root_rate, file_),
          rest.begin);
    }
    if (accelerometer > noise_factor) {
      add(Severity::warning, "accelerometer_noise",
          fmt::format("the acceleration's noise is {:.2g} m/s2 per sample, {:.1f} times that of the platform file",
                      rest.accelerometer_noise, accelerometer),
          fmt::format("imu.accelerometer_noise_density_m_s2_sqrt_hz: {:.2g} in {}",
                      rest.accelerometer_noise / root_rate, file_),
          rest.begin);
    }
  }

  const LogSample& sample_;
  const Platform& platform_;
  std::string file_;
  Findings findings_;
};

}  // namespace

std::optional<RestSpan> calmest_span(const std::vector<ImuSample>& imu, Time length) {
  std::optional<RestSpan> best;
  std::size_t end = 0;
  Time next_begin = std::numeric_limits<Time>::min();
  for (std::size_t begin = 0; begin < imu.size(); ++begin) {
    if (imu[begin].time < next_begin) continue;
    while (end < imu.size() && imu[end].time < imu[begin].time + length) ++end;
    if (end == imu.size()) break;
    next_begin = imu[begin].time + length / 5;
    if (end - begin < 10) continue;
    const RestSpan span = describe(imu, begin, end);
    if (!best || span.shaking_m_s2 < best->shaking_m_s2) best = span;
  }
  return best;
}

Findings check_imu(const LogSample& sample, const Platform& platform) {
  return sample.imu.empty() ? Findings{} : ImuCheck(sample, platform).run();
}

}  // namespace lodestone

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tools/check/sensor_checks.h"
#include "tools/check/turn_integral.h"

namespace lodestone {
namespace {

constexpr std::size_t least_pairs = 20;
constexpr double velocity_change_s = 1.0;  // over which changes of velocity are compared
constexpr double least_change_m_s = 0.2;   // rms of the changes; tilt and bias of the IMU are less
constexpr double sure_correlation = 0.8;
constexpr double unit_factor = 2.0;  // a wrong wheel diameter is less
constexpr double longest_clock_offset_s = 0.5;
constexpr double clock_step_s = 0.005;
constexpr double tolerated_clock_offset_s = 0.03;  // 3 cm/s at 1 m/s²: the noise of wheel odometry
constexpr double least_turn_rate_rad_s = 0.1;      // rms

/// Two series of the same quantity, by the wheels and by the IMU, without their means.
class PairedSeries {
 public:
  void add(double wheels, double imu) {
    wheels_.push_back(wheels);
    imu_.push_back(imu);
  }
  std::size_t size() const { return imu_.size(); }
  double imu_rms() const { return std::sqrt(covariance(imu_, imu_)); }
  /// Wheels over IMU, by least squares.
  double factor() const { return covariance(wheels_, imu_) / covariance(imu_, imu_); }
  double correlation() const {
    const double product = covariance(wheels_, wheels_) * covariance(imu_, imu_);
    return product > 0.0 ? covariance(wheels_, imu_) / std::sqrt(product) : 0.0;
  }

 private:
  static double mean(const std::vector<double>& values) {
    double sum = 0.0;
    for (const double value : values) sum += value;
    return sum / static_cast<double>(values.size());
  }
  static double covariance(const std::vector<double>& a, const std::vector<double>& b) {
    const double mean_a = mean(a), mean_b = mean(b);
    double sum = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += (a[i] - mean_a) * (b[i] - mean_b);
    return sum / static_cast<double>(a.size());
  }

  std::vector<double> wheels_, imu_;
};

/// Changes of the forward velocity over a second: by the wheels, and as the integral of the specific force. Gravity on
/// a constant slope and the accelerometer's bias are the mean of the latter.
PairedSeries velocity_changes(const LogSample& sample, const Quaternion& R_imu_wheels) {
  const Vector3 forwards = R_imu_wheels * Vector3::UnitX();
  std::vector<double> velocity_m_s{0.0};  // integral of the specific force, at each IMU sample
  for (std::size_t i = 1; i < sample.imu.size(); ++i) {
    const double step_s = to_seconds(sample.imu[i].time - sample.imu[i - 1].time);
    velocity_m_s.push_back(velocity_m_s.back() + step_s * forwards.dot(sample.imu[i].linear_acceleration));
  }
  const auto imu_velocity_at = [&](Time time) {
    const auto found = std::ranges::lower_bound(sample.imu, time, {}, &ImuSample::time);
    return velocity_m_s[static_cast<std::size_t>(found - sample.imu.begin())];
  };
  PairedSeries result;
  const Time span = from_seconds(velocity_change_s);
  std::size_t before = 0;
  for (std::size_t i = 0; i < sample.wheels.size(); ++i) {
    const WheelSample& now = sample.wheels[i];
    if (now.time > sample.imu.back().time) break;
    while (now.time - sample.wheels[before].time > span) ++before;
    const WheelSample& then = sample.wheels[before];
    if (then.time < sample.imu.front().time || 2 * (now.time - then.time) < span) continue;
    result.add(now.forward_velocity_m_s - then.forward_velocity_m_s,
               imu_velocity_at(now.time) - imu_velocity_at(then.time));
  }
  return result;
}

/// Turn rates of the wheels and of the gyroscope, whose samples are `offset_s` earlier than the wheels'.
PairedSeries turn_rates(const LogSample& sample, const TurnIntegral& turns, const Quaternion& R_imu_wheels,
                        double offset_s) {
  PairedSeries result;
  for (std::size_t i = 1; i + 1 < sample.wheels.size(); ++i) {
    const WheelSample& wheels = sample.wheels[i];
    const Time half = (sample.wheels[i + 1].time - sample.wheels[i - 1].time) / 4;
    const Time middle = wheels.time - from_seconds(offset_s);
    const auto turn = turns.over(middle - half, middle + half);
    if (turn) result.add(wheels.yaw_rate_rad_s, (R_imu_wheels.conjugate() * *turn).z() / to_seconds(2 * half));
  }
  return result;
}

void check_velocity(const LogSample& sample, const Platform& platform, Findings& findings) {
  const PairedSeries changes = velocity_changes(sample, platform.suite.wheels->T_imu_wheels.rotation);
  if (changes.size() < least_pairs || changes.imu_rms() < least_change_m_s) return;
  const double correlation = changes.correlation();
  const Time time = sample.wheels.front().time;
  if (correlation < -sure_correlation) {
    findings.push_back(
        {Severity::warning, "wheels.reverse",
         fmt::format("{}: the wheels' velocity falls when the robot accelerates forwards (correlation {:.2f})",
                     platform.wheels.topic, correlation),
         fmt::format("turn wheels.T_imu_wheels in {} by 180 degrees about z, or correct the driver's sign",
                     platform.file_name()),
         time});
  }
  const double factor = changes.factor();
  if (correlation > sure_correlation && (factor > unit_factor || factor < 1.0 / unit_factor)) {
    findings.push_back({Severity::warning, "wheels.unit",
                        fmt::format("{}: the wheels' velocity changes by {:.3g} times the IMU's; expected m/s",
                                    platform.wheels.topic, factor),
                        fmt::format("wheels.scale: {:.3g} in {} (1000 if the messages are in mm/s)",
                                    platform.wheels.scale * factor, platform.file_name()),
                        time});
  }
}

void check_clock(const LogSample& sample, const Platform& platform, Findings& findings) {
  const Quaternion& R_imu_wheels = platform.suite.wheels->T_imu_wheels.rotation;
  const TurnIntegral turns(sample.imu);
  double best = 0.0, best_s = 0.0;
  for (double offset_s = -longest_clock_offset_s; offset_s <= longest_clock_offset_s; offset_s += clock_step_s) {
    const PairedSeries rates = turn_rates(sample, turns, R_imu_wheels, offset_s);
    if (rates.size() < least_pairs || rates.imu_rms() < least_turn_rate_rad_s) continue;
    const double correlation = rates.correlation();
    if (correlation <= best) continue;
    best = correlation;
    best_s = offset_s;
  }
  if (best < sure_correlation || std::abs(best_s) < tolerated_clock_offset_s) return;
  findings.push_back(
      {Severity::warning, "clock.wheels",
       fmt::format("{}: the wheels turn {:.0f} ms {} than the gyroscope (correlation {:.2f})", platform.wheels.topic,
                   1e3 * std::abs(best_s), best_s > 0.0 ? "later" : "earlier", best),
       fmt::format("wheels.clock_offset_s: {:.3f} in {}", platform.wheels.clock_offset_s + best_s,
                   platform.file_name()),
       sample.wheels.front().time});
}

}  // namespace

Findings check_wheels(const LogSample& sample, const Platform& platform) {
  Findings findings;
  if (!platform.suite.wheels || sample.wheels.empty() || sample.imu.size() < 2) return findings;
  check_velocity(sample, platform, findings);
  check_clock(sample, platform, findings);
  return findings;
}

}  // namespace lodestone

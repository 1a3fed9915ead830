#include "core/magnetometer/magnetometer_monitor.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/middle_value.h"

namespace lodestone {

namespace {

constexpr double kSame = 0.02;  // of the sensor's noise: smaller differences count as no change
constexpr int kRepeats = 20;    // unchanged readings in a row that noise cannot explain
constexpr int kRepeatsAtShownLimit = 3;
constexpr Time kHeld = 100'000'000;      // and over this time: a driver may repeat a slow sensor's readings
constexpr double kVaries = 5.0;          // times the noise: a larger range within a run is more than noise
constexpr double kSpike = 7.0;           // sigmas from the neighbours' median
constexpr double kNormalSigma = 1.4826;  // sigma of a normal distribution over its median absolute deviation
constexpr Time kSilent = 1'000'000'000;

std::string seconds(Time time) {
  return fmt::format("{:.3f} s", to_seconds(time));
}

}  // namespace

MagnetometerMonitor::MagnetometerMonitor(const SensorSuite& suite, WarningLog* warnings)
    : models_(suite.magnetometers), warnings_(warnings), sensors_(suite.magnetometers.size()) {}

void MagnetometerMonitor::warn(const char* what, std::size_t j, const std::string& detail, Time time) {
  if (warnings_ != nullptr) warnings_->add(fmt::format("magnetometer.{}.{}", what, models_[j].name), detail, time);
}

/// Updates the runs; returns whether this reading repeats those before.
bool MagnetometerMonitor::stays(std::size_t j, const Vector3& reading, Time time) {
  Sensor& sensor = sensors_[j];
  const double same_ut = kSame * models_[j].noise_ut;
  int held = 0;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    Run& run = sensor.runs[static_cast<std::size_t>(axis)];
    if (run.readings == 0 || std::abs(reading[axis] - run.held_ut) > same_ut)
      run = {0, time, reading[axis], reading, reading};
    ++run.readings;
    run.low_ut = run.low_ut.cwiseMin(reading);
    run.high_ut = run.high_ut.cwiseMax(reading);
    if (run.readings >= kRepeats && time - run.since >= kHeld) ++held;
  }
  return held == 3;
}

bool MagnetometerMonitor::at_limit(std::size_t j, const Vector3& reading, Time time) {
  Sensor& sensor = sensors_[j];
  const double same_ut = kSame * models_[j].noise_ut;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const Run& run = sensor.runs[static_cast<std::size_t>(axis)];
    const bool held = run.readings >= kRepeats && time - run.since >= kHeld;
    const bool others_vary = (run.high_ut - run.low_ut).maxCoeff() > kVaries * models_[j].noise_ut;
    // A reading beyond the limit shows that it is not, or no longer, a limit.
    if (std::abs(reading[axis]) > sensor.limit_ut[axis] + kVaries * models_[j].noise_ut) {
      sensor.limit_ut[axis] = std::numeric_limits<double>::infinity();
    }
    const double size_ut = std::abs(run.held_ut);
    if (held && others_vary) shown_limit_ut_ = size_ut;
    const bool as_shown = run.readings >= kRepeatsAtShownLimit && std::abs(size_ut - shown_limit_ut_) <= same_ut;
    if ((held && others_vary) || as_shown) sensor.limit_ut[axis] = std::min(sensor.limit_ut[axis], size_ut);
  }
  return ((reading.cwiseAbs() - sensor.limit_ut).array() >= -same_ut).any();
}

/// Spikes in a bundle's readings, with the last two readings before as neighbours.
std::vector<bool> MagnetometerMonitor::spikes(std::size_t j, const std::vector<Vector3>& readings) const {
  std::vector<Vector3> all = sensors_[j].before;
  const std::size_t first = all.size();
  all.insert(all.end(), readings.begin(), readings.end());
  std::vector<bool> result(readings.size(), false);
  if (all.size() < 3) return result;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    std::vector<double> departures;
    std::vector<double> steps;
    for (std::size_t i = first; i < all.size(); ++i) {
      // Up to two neighbours on either side; the same number on both sides if both have some.
      const std::size_t reach = std::clamp<std::size_t>(std::min(i, all.size() - 1 - i), 1, 2);
      const std::size_t low = std::min(i - std::min(i, reach), all.size() - 3);
      const std::size_t high = std::min(std::max(i + reach, std::size_t{2}), all.size() - 1);
      std::vector<double> neighbours;
      for (std::size_t k = low; k <= high; ++k) neighbours.push_back(all[k][axis]);
      departures.push_back(std::abs(all[i][axis] - middle_value(neighbours)));
      if (i > 0) steps.push_back(std::abs(all[i][axis] - all[i - 1][axis]));
    }
    // The platform file may understate the noise, and the field may change fast: the readings themselves show both.
    const double sigma_ut = std::max(models_[j].noise_ut, kNormalSigma * middle_value(departures));
    const double limit_ut = kSpike * sigma_ut + 2.0 * middle_value(steps);
    for (std::size_t i = 0; i < readings.size(); ++i) result[i] = result[i] || departures[i] > limit_ut;
  }
  return result;
}

std::optional<std::vector<MagneticArraySample>> MagnetometerMonitor::without_unhealthy(
    const std::vector<MagneticArraySample>& samples, Time end) {
  std::vector<MagneticArraySample> result = samples;
  bool changed = false;
  for (std::size_t j = 0; j < sensors_.size(); ++j) {
    Sensor& sensor = sensors_[j];
    std::vector<std::size_t> places;
    std::vector<Vector3> readings;
    for (std::size_t i = 0; i < samples.size(); ++i) {
      if (j >= samples[i].field_ut.size() || !samples[i].field_ut[j]) continue;
      places.push_back(i);
      readings.push_back(*samples[i].field_ut[j]);
    }
    const std::vector<bool> is_spike = spikes(j, readings);
    for (std::size_t i = 0; i < places.size(); ++i) {
      const Time time = samples[places[i]].time;
      const bool stuck = stays(j, readings[i], time);
      const bool limited = !stuck && !is_spike[i] && at_limit(j, readings[i], time);
      if (stuck) {
        warn("stuck", j,
             fmt::format("the reading ({:.2f} {:.2f} {:.2f} µT) has not changed since {}; discarded", readings[i].x(),
                         readings[i].y(), readings[i].z(), seconds(sensor.runs[0].since)),
             time);
      } else if (is_spike[i]) {
        warn("spike", j, "the reading at " + seconds(time) + " is far from its neighbours in time; discarded", time);
      } else if (limited) {
        warn("limit", j,
             fmt::format("a component does not exceed {:.2f} µT at {}; readings at this limit are discarded",
                         sensor.limit_ut.minCoeff(), seconds(time)),
             time);
      }
      if (stuck || is_spike[i] || limited) {
        result[places[i]].field_ut[j].reset();
        changed = true;
      }
    }
    if (!readings.empty()) {
      sensor.last = samples[places.back()].time;
      readings.insert(readings.begin(), sensor.before.begin(), sensor.before.end());
      sensor.before.assign(readings.end() - std::min<std::ptrdiff_t>(2, std::ssize(readings)), readings.end());
    }
    if (!sensor.last) sensor.last = end;  // the beginning of the log
    if (end - *sensor.last >= kSilent) warn("silent", j, "no reading since " + seconds(*sensor.last), end);
  }
  if (!changed) return std::nullopt;
  return result;
}

}  // namespace lodestone

#include "frontends/synchronizer/recorded_array.h"

#include <optional>

#include "core/magnetometer/magnetometer_monitor.h"
#include "frontends/synchronizer/array_grouping.h"

namespace lodestone {

namespace {

constexpr Time kBundle = from_seconds(0.5);    // a multiple of ArrayLog's span
constexpr Time kPatience = from_seconds(0.5);  // largest delay of a magnetometer's messages after those of others

}  // namespace

RecordedArray record_array(MeasurementSource& source, const SensorSuite& suite, WarningLog& warnings,
                           const std::function<void(Time)>& progress) {
  RecordedArray result{ArrayLog(suite.magnetometers.size()), {}};
  ArrayGrouping grouping(suite.magnetometers.size());
  MagnetometerMonitor monitor(suite, &warnings);
  const auto drain = [&](Time end) {
    std::vector<MagneticArraySample> samples;
    while (std::optional<MagneticArraySample> sample = grouping.take(end)) samples.push_back(std::move(*sample));
    if (auto healthy = monitor.without_unhealthy(samples, end)) samples = std::move(*healthy);
    result.readings.add(samples);
    grouping.forget(end);
  };
  std::optional<Time> end;  // of the current bundle
  Time latest = 0;
  Measurement measurement;
  while (source.next(measurement)) {
    if (progress) progress(completion_time(measurement));
    if (const auto* imu = std::get_if<ImuSample>(&measurement)) result.imu.push_back(*imu);
    const auto* sample = std::get_if<MagneticSample>(&measurement);
    if (sample == nullptr) continue;
    if (!end) end = sample->time + kBundle;
    if (!grouping.add(*sample)) continue;
    latest = std::max(latest, sample->time);
    for (; *end + kPatience < sample->time; *end += kBundle) drain(*end);
  }
  for (; end && *end < latest + kBundle; *end += kBundle) drain(*end);
  return result;
}

}  // namespace lodestone

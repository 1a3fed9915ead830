#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "core/magnetometer/magnetometer_monitor.h"
#include "frontends/messages/sensor_checks.h"
#include "frontends/messages/stream_decoder.h"
#include "tools/check/sensor_checks.h"

namespace lodestone {
namespace {

constexpr std::size_t bundle = 20;  // readings per call of the monitor
constexpr std::int64_t few = 3;     // spikes or readings at a limit that occur by chance
constexpr double zero_ut = 1e-6;

/// Checks the unit. True if a run would refuse it.
bool check_unit(const LogSample& sample, const Platform& platform, std::size_t magnetometer, Findings& findings) {
  FirstReadings readings;
  const std::vector<MagneticSample>& list = sample.fields[magnetometer];
  for (std::size_t i = 0; i < std::min<std::size_t>(200, list.size()); ++i)
    readings.add(list[i].time, list[i].field_ut.norm());
  try {
    check_field(sample.path, platform, magnetometer, readings);
  } catch (const InputError& error) {
    findings.push_back(error_finding("magnetometer.unit", error));
    return true;
  }
  if (readings.finite_count == 0 || readings.mean_magnitude() > zero_ut) return false;
  findings.push_back({Severity::error, "magnetometer.zero",
                      fmt::format("{}: all readings are zero", platform.magnetometers[magnetometer].topic),
                      fmt::format("check the sensor, or remove magnetometers[{}] from the platform file", magnetometer),
                      list.front().time});
  return true;
}

/// The estimators' monitor, applied to one magnetometer.
WarningLog monitored(const std::vector<MagneticSample>& list, const MagnetometerMessageLayout& layout,
                     const MagnetometerModel& model) {
  WarningLog warnings;
  SensorSuite suite;
  suite.magnetometers = {model};
  MagnetometerMonitor monitor(suite, &warnings);
  std::vector<MagneticArraySample> samples;
  for (std::size_t i = 0; i < list.size(); ++i) {
    samples.push_back({list[i].time, {calibrated(layout, list[i].field_ut)}});
    if (samples.size() < bundle && i + 1 < list.size()) continue;
    monitor.without_unhealthy(samples, samples.back().time);
    samples.clear();
  }
  return warnings;
}

struct Symptom {
  const char* name;
  const char* change;
};

constexpr std::array<Symptom, 3> symptoms{{
    {"stuck", "check the sensor and its driver"},
    {"limit", "increase the sensor's range, or mount it farther from steel"},
    {"spike", "check the sensor's cable and bus"},
}};

}  // namespace

Findings check_magnetometers(const LogSample& sample, const Platform& platform) {
  Findings findings;
  for (std::size_t j = 0; j < sample.fields.size(); ++j) {
    if (sample.fields[j].empty() || check_unit(sample, platform, j, findings)) continue;
    const MagnetometerModel& model = platform.suite.magnetometers[j];
    const WarningLog warnings = monitored(sample.fields[j], platform.magnetometers[j], model);
    for (const Symptom& symptom : symptoms) {
      const auto found = warnings.entries().find(fmt::format("magnetometer.{}.{}", symptom.name, model.name));
      if (found == warnings.entries().end()) continue;
      const WarningLog::Entry& entry = found->second;
      findings.push_back({entry.count > few ? Severity::warning : Severity::note,
                          std::string("magnetometer.") + symptom.name,
                          fmt::format("{} ({}): {} of {} readings: {}", model.name, platform.magnetometers[j].topic,
                                      entry.count, sample.fields[j].size(), entry.first_detail),
                          symptom.change, entry.first_time, j});
    }
  }
  return findings;
}

}  // namespace lodestone

#include "frontends/messages/sensor_checks.h"

#include <fmt/format.h>

#include <cmath>

#include "core/error.h"
#include "frontends/configuration/options.h"

namespace lodestone {

std::string fitting_field_unit(double value_as_written) {
  constexpr double earth_ut = 45.0;
  std::string fitting;
  double nearest = std::log(6.0);  // tolerated factor: steel changes the field as much
  for (const auto& [unit, name] : enum_names(FieldUnit::tesla)) {
    const double away = std::abs(std::log(value_as_written * microtesla_per(unit) / earth_ut));
    if (!(away < nearest)) continue;
    nearest = away;
    fitting = name;
  }
  return fitting;
}

std::optional<AccelerationUnit> fitting_acceleration_unit(double value_as_written, double gravity_m_s2) {
  if (std::abs(value_as_written - 1.0) < 0.3) return AccelerationUnit::standard_gravity;
  const bool fits = value_as_written >= 0.5 * gravity_m_s2 && value_as_written <= 2.0 * gravity_m_s2;
  return fits ? std::optional(AccelerationUnit::metres_per_second_squared) : std::nullopt;
}

void check_acceleration(const std::string& source, const Platform& platform, const FirstReadings& readings) {
  if (readings.finite_count == 0) return;
  const double gravity = platform.suite.gravity_m_s2;
  const double mean = readings.mean_magnitude();
  const std::string found = fmt::format(
      "{}: {}: the acceleration's mean magnitude is {:.3g} m/s2; expected the specific force including "
      "gravity, about {:.4g} (gravity_m_s2)",
      source, platform.imu.topic, mean, gravity);
  const bool read_as_g = platform.imu.acceleration_unit == AccelerationUnit::standard_gravity;
  const auto fitting = fitting_acceleration_unit(mean, gravity);
  if (!read_as_g && fitting == AccelerationUnit::standard_gravity) {
    throw InputError(found + "; the IMU is in g: set imu.acceleration_unit: g in " + platform.file_name());
  }
  if (read_as_g && mean > 5.0 * gravity) {
    throw InputError(found + "; the IMU is in m/s2: set imu.acceleration_unit: m/s2 in " + platform.file_name());
  }
  if (mean < 0.5 * gravity || mean > 2.0 * gravity) {
    throw InputError(found + "; check imu.acceleration_unit and gravity_m_s2 in " + platform.file_name() +
                     ", and that the IMU does not subtract gravity");
  }
}

void check_field(const std::string& source, const Platform& platform, std::size_t magnetometer,
                 const FirstReadings& readings, WarningLog* warnings) {
  constexpr double largest_ut = 1000.0;
  const double mean_ut = readings.mean_magnitude();
  // Exact zeros are a dead sensor, which the estimators reject. Other values below this limit have a wrong unit.
  constexpr double smallest_ut = 0.1;
  constexpr double usual_low_ut = 5.0, usual_high_ut = 250.0;
  if (readings.finite_count == 0 || mean_ut == 0.0) return;
  const MagnetometerMessageLayout& layout = platform.magnetometers[magnetometer];
  const double as_written = mean_ut / microtesla_per(layout.unit);
  const std::string unit_name = options_detail::write_value(layout.unit);
  const std::string fitting = fitting_field_unit(as_written);
  const std::string in_microtesla = fmt::format("{:.4g} microtesla", mean_ut);
  const std::string found = layout.unit == FieldUnit::microtesla
                                ? in_microtesla
                                : fmt::format("{:.4g} {}, {}", as_written, unit_name, in_microtesla);
  const std::string change =
      fitting.empty() || fitting == unit_name
          ? fmt::format("check the unit of magnetometers[{}]", magnetometer)
          : fmt::format("it looks like {0}: set magnetometers[{1}].unit: {0}", fitting, magnetometer);
  if (mean_ut < smallest_ut || mean_ut > largest_ut) {
    throw InputError(fmt::format("{}: {}: the field's mean magnitude is {}; expected {:g} to {:g} microtesla; {} in {}",
                                 source, layout.topic, found, smallest_ut, largest_ut, change, platform.file_name()));
  }
  // Steel and hard iron change the field, but hardly beyond these limits.
  if (warnings == nullptr || (mean_ut > usual_low_ut && mean_ut < usual_high_ut)) return;
  warnings->add("magnetometer.magnitude",
                fmt::format("{}: the field's mean magnitude is {}; usual are 20 to 70; if so, {} in {}", layout.topic,
                            found, change, platform.file_name()),
                readings.first_stamp);
}

void check_clock(const std::string& source, const std::string& topic, Time first_stamp,
                 const std::string& reference_topic, Time first_reference_stamp, double duration_s) {
  if (first_stamp == 0) {
    throw InputError(
        fmt::format("{}: {}: the messages have no stamp (0 s); record the sensor's time in the messages' "
                    "headers",
                    source, topic));
  }
  const double apart_s = to_seconds(first_stamp - first_reference_stamp);
  if (std::abs(apart_s) <= duration_s + 1.0) return;
  throw InputError(
      fmt::format("{}: the first stamps of {} and {} differ by {:.3f} s, in a log of {:.3f} s: the clocks differ; "
                  "record both with one clock",
                  source, topic, reference_topic, apart_s, duration_s));
}

}  // namespace lodestone

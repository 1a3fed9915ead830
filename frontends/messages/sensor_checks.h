#pragma once

#include <cmath>
#include <optional>
#include <string>

#include "core/time.h"
#include "core/warnings.h"
#include "frontends/configuration/platform.h"

/// Checks of each sensor's unit and clock from its first second, for any log format. A wrong unit would spoil a run
/// silently, so it is refused before the run.
namespace lodestone {

/// Mean of a sensor's first readings.
struct FirstReadings {
  int wanted = 0;  ///< required number
  int count = 0;
  int finite_count = 0;
  double magnitude_sum = 0.0;  ///< of the finite ones, in the unit of the measurement (m/s², µT)
  Time first_stamp = 0;

  void add(Time stamp, double magnitude) {
    if (count++ == 0) first_stamp = stamp;
    if (!std::isfinite(magnitude)) return;
    ++finite_count;
    magnitude_sum += magnitude;
  }
  double mean_magnitude() const { return finite_count > 0 ? magnitude_sum / finite_count : 0.0; }
};

/// The unit in which an acceleration of this magnitude is a specific force near gravity; nothing if no unit fits.
std::optional<AccelerationUnit> fitting_acceleration_unit(double value_as_written, double gravity_m_s2);

/// Throws InputError if the mean acceleration is not a specific force in m/s² near gravity: in g, or without gravity.
/// `source` names the log.
void check_acceleration(const std::string& source, const Platform& platform, const FirstReadings& readings);

/// The name of the unit in which values of this magnitude are nearest to the earth's field; empty if none is near.
std::string fitting_field_unit(double value_as_written);

/// Throws InputError with the fitting unit if the field is impossible in the platform's unit (above 1000 µT, or below
/// 0.1 µT and not zero). If the magnitude is only unusual (20 to 70 µT are usual) and another unit explains it, this is
/// counted as magnetometer.magnitude (if `warnings` is not null).
void check_field(const std::string& source, const Platform& platform, std::size_t magnetometer,
                 const FirstReadings& readings, WarningLog* warnings = nullptr);

/// Throws InputError if a sensor's stamps are zero, or so far from those of the reference topic that they cannot
/// overlap in a log of `duration_s`: the clocks differ.
void check_clock(const std::string& source, const std::string& topic, Time first_stamp,
                 const std::string& reference_topic, Time first_reference_stamp, double duration_s);

}  // namespace lodestone

#pragma once

#include <cmath>
#include <string>

#include "core/time.h"
#include "core/warnings.h"
#include "frontends/configuration/platform.h"

/// What the first second of each sensor tells about its unit and its clock, whatever the log's format. A wrong unit
/// spoils a run silently, so that it is refused before the run starts.
namespace lodestone {

/// Mean of a sensor's first readings.
struct FirstReadings {
  int wanted = 0;  ///< how many are worth waiting for
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

/// Throws InputError where the mean acceleration is no specific force in m/s² near gravity: in g, or without gravity.
/// `source` names the log.
void check_acceleration(const std::string& source, const Platform& platform, const FirstReadings& readings);

/// The name of the unit in which values of this size come nearest to the earth's field; empty where none comes near,
/// steel and all.
std::string fitting_field_unit(double value_as_written);

/// Throws InputError where the field cannot be what the platform's unit makes of it (more than 1000 µT, or less than
/// 0.1 µT and not zero), and names the unit that would fit. Where the size is only unusual (20 to 70 µT are usual) and
/// another unit explains it, that is counted as magnetometer.magnitude (by nobody where `warnings` is null).
void check_field(const std::string& source, const Platform& platform, std::size_t magnetometer,
                 const FirstReadings& readings, WarningLog* warnings = nullptr);

/// Throws InputError where a sensor's stamps are zero, or so far from those of the reference topic that the two never
/// meet in a log of `duration_s`: their clocks differ.
void check_clock(const std::string& source, const std::string& topic, Time first_stamp,
                 const std::string& reference_topic, Time first_reference_stamp, double duration_s);

}  // namespace lodestone

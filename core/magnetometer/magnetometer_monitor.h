#pragma once

#include <array>
#include <limits>
#include <optional>
#include <vector>

#include "core/measurements.h"
#include "core/sensor_suite.h"
#include "core/warnings.h"

namespace lodestone {

/// Watches each magnetometer of the array by its own readings alone, before any map or pose has a say, and leaves out
/// what cannot be a measurement:
/// - stuck: all components stay what they are, to a fiftieth of the sensor's noise, over 20 readings and 0.1 s;
/// - at its limit: one or two components do so while another one varies by more than noise does. From then on whatever
///   reaches that limit is left out at once, until a reading goes well beyond it. Sensors of an array are of one make:
///   where one has shown its limit, three readings in a row of the very same size show that it is another's too;
/// - spikes: a single reading far from the median of its neighbours in time;
/// and tells of magnetometers that fell silent. What it does not leave out it does not change.
///
/// Counted in the warnings, for each magnetometer by its name: magnetometer.stuck.NAME, .limit.NAME, .spike.NAME
/// (readings left out) and .silent.NAME (scans without a reading for a second).
class MagnetometerMonitor {
 public:
  /// `warnings` may be null; it must outlive this.
  MagnetometerMonitor(const SensorSuite& suite, WarningLog* warnings);

  /// The samples of a bundle, which follow those of the bundle before, without the unhealthy readings; `end`: the
  /// bundle's. Nothing where all are healthy.
  std::optional<std::vector<MagneticArraySample>> without_unhealthy(const std::vector<MagneticArraySample>& samples,
                                                                    Time end);

 private:
  /// Readings in a row in which one component stays what it is.
  struct Run {
    int readings = 0;
    Time since = 0;
    double held_ut = 0.0;
    Vector3 low_ut = Vector3::Zero();  // of all components meanwhile
    Vector3 high_ut = Vector3::Zero();
  };
  struct Sensor {
    std::array<Run, 3> runs;
    Vector3 limit_ut = Vector3::Constant(std::numeric_limits<double>::infinity());
    std::vector<Vector3> before;  // its last two readings
    std::optional<Time> last;
  };

  bool stays(std::size_t j, const Vector3& reading, Time time);
  bool at_limit(std::size_t j, const Vector3& reading, Time time);
  std::vector<bool> spikes(std::size_t j, const std::vector<Vector3>& readings) const;
  void warn(const char* what, std::size_t j, const std::string& detail, Time time);

  std::vector<MagnetometerModel> models_;
  WarningLog* warnings_;
  std::vector<Sensor> sensors_;
  double shown_limit_ut_ = std::numeric_limits<double>::infinity();  // the last that any sensor showed by itself
};

}  // namespace lodestone

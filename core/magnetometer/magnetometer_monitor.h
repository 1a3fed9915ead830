#pragma once

#include <array>
#include <limits>
#include <optional>
#include <vector>

#include "core/measurements.h"
#include "core/sensor_suite.h"
#include "core/warnings.h"

namespace lodestone {

/// Checks each magnetometer of the array by its own readings alone, without map or pose, and discards readings that
/// cannot be measurements (docs/design/018):
/// - stuck: all components stay the same, to a fiftieth of the sensor's noise, over 20 readings and 0.1 s;
/// - limit: one or two components do so while another varies by more than noise. From then on, all readings that reach
///   this limit are discarded at once, until a reading clearly exceeds it. Sensors of an array are assumed to have
///   equal limits: if one sensor has shown its limit, three readings in a row at this value show it for another;
/// - spike: a single reading far from the median of its neighbours in time.
/// Silent magnetometers are reported. All other readings are unchanged.
///
/// Warnings are counted for each magnetometer by its name: magnetometer.stuck.NAME, .limit.NAME, .spike.NAME (discarded
/// readings) and .silent.NAME (scans without a reading for a second).
class MagnetometerMonitor {
 public:
  /// `warnings` may be null; it must outlive the monitor.
  MagnetometerMonitor(const SensorSuite& suite, WarningLog* warnings);

  /// The samples of a bundle without the discarded readings; empty if none is discarded. Bundles must be passed in
  /// order. `end`: of the bundle.
  std::optional<std::vector<MagneticArraySample>> without_unhealthy(const std::vector<MagneticArraySample>& samples,
                                                                    Time end);

 private:
  /// Consecutive readings in which one component stays the same.
  struct Run {
    int readings = 0;
    Time since = 0;
    double held_ut = 0.0;
    Vector3 low_ut = Vector3::Zero();  // of all components during the run
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
  double shown_limit_ut_ = std::numeric_limits<double>::infinity();  // the last limit that a sensor showed by itself
};

}  // namespace lodestone

#include "localization/measurement_list.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>

#include "core/error.h"
#include "frontends/configuration/trajectory_file.h"

namespace lodestone {

namespace {

[[noreturn]] void refuse(const std::string& sensor, Time time, const std::string& problem) {
  throw InputError(fmt::format("measurements in memory: {} at {} s: {}", sensor, format_stamp(time), problem));
}

/// Examines one measurement. Returns the name of its sensor.
class MeasurementCheck {
 public:
  explicit MeasurementCheck(const SensorSuite& suite) : suite_(suite) {}

  std::string operator()(const ImuSample& sample) const {
    require_finite("imu", sample.time, sample.angular_velocity.sum() + sample.linear_acceleration.sum());
    return "imu";
  }

  std::string operator()(const WheelSample& sample) const {
    require_finite("wheels", sample.time,
                   sample.forward_velocity_m_s + sample.lateral_velocity_m_s + sample.yaw_rate_rad_s);
    return "wheels";
  }

  std::string operator()(const MagneticSample& sample) const {
    const std::string sensor = fmt::format("magnetometer {}", sample.magnetometer);
    const std::size_t count = suite_.magnetometers.size();
    if (sample.magnetometer < 0 || static_cast<std::size_t>(sample.magnetometer) >= count) {
      refuse(sensor, sample.time, fmt::format("the platform has {} magnetometers, counted from 0", count));
    }
    require_finite(sensor, sample.time, sample.field_ut.sum());
    return sensor;
  }

  std::string operator()(const LidarScan& scan) const {
    if (scan.end < scan.start) refuse("scan", scan.start, "the scan ends before its start");
    const std::size_t lidars = suite_.further_lidars.size() + 1;
    for (const LidarPoint& point : scan.points) {
      require_finite("scan", scan.start, point.position.sum());
      if (point.lidar >= lidars) {
        refuse("scan", scan.start, fmt::format("a point is of LiDAR {}; the platform has {}", point.lidar, lidars));
      }
      if (point.offset_ns < 0 || point.offset_ns > scan.end - scan.start) {
        refuse("scan", scan.start,
               fmt::format("a point has offset_ns {}; expected 0 to {}", point.offset_ns, scan.end - scan.start));
      }
    }
    return "scan";
  }

 private:
  static void require_finite(const std::string& sensor, Time time, double sum) {
    if (!std::isfinite(sum)) refuse(sensor, time, "a value is not finite; remove such samples and points");
  }

  const SensorSuite& suite_;
};

}  // namespace

MeasurementList::MeasurementList(std::vector<Measurement> measurements, const SensorSuite& suite)
    : measurements_(std::move(measurements)) {
  std::stable_sort(measurements_.begin(), measurements_.end(),
                   [](const Measurement& a, const Measurement& b) { return completion_time(a) < completion_time(b); });
  const MeasurementCheck check(suite);
  std::map<std::string, Time> newest;
  for (const Measurement& measurement : measurements_) {
    const std::string sensor = std::visit(check, measurement);
    const Time time = completion_time(measurement);
    const auto* scan = std::get_if<LidarScan>(&measurement);
    if (const Time begin = scan == nullptr ? time : scan->start; begin < 0 || time > farthest_time) {
      refuse(sensor, begin < 0 ? begin : time,
             "expected a stamp from 0 to 4e18 ns; add the same time to all stamps, also to those of trajectories");
    }
    const auto [previous, is_first] = newest.try_emplace(sensor, time);
    if (!is_first && previous->second == time) refuse(sensor, time, "two samples have this stamp; remove one");
    previous->second = time;
  }
}

bool MeasurementList::next(Measurement& measurement) {
  if (next_ == measurements_.size()) return false;
  measurement = measurements_[next_++];
  return true;
}

Time MeasurementList::begin_time() const {
  return measurements_.empty() ? 0 : completion_time(measurements_.front());
}

Time MeasurementList::end_time() const {
  return measurements_.empty() ? 0 : completion_time(measurements_.back());
}

}  // namespace lodestone

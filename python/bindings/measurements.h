#pragma once

#include <string>
#include <vector>

#include "bindings/arrays.h"
#include "core/measurements.h"
#include "frontends/configuration/platform.h"
#include "localization/site.h"

namespace lodestone::python {

/// Measurements of one robot in memory, from arrays or a log.
class Measurements {
 public:
  explicit Measurements(Platform platform) : platform_(std::move(platform)) {}

  const Platform& platform() const { return platform_; }
  std::size_t size() const { return measurements_.size(); }
  void add(Measurement measurement) {
    if (std::holds_alternative<LidarScan>(measurement)) scans_.push_back(measurements_.size());
    measurements_.push_back(std::move(measurement));
  }

  void add_imu(const py::object& stamp_ns, const py::object& gyroscope_rad_s, const py::object& accelerometer_m_s2);
  void add_field(const std::string& magnetometer, const py::object& stamp_ns, const py::object& field_ut);
  void add_wheels(const py::object& stamp_ns, const py::object& forward_velocity_m_s, const py::object& yaw_rate_rad_s,
                  const py::object& lateral_velocity_m_s);
  void add_scan(Time start_ns, const py::object& points_m, const py::object& offset_ns, const py::object& end_ns,
                const py::object& intensity, const py::object& ring, const py::object& lidar);

  /// Scans in the order of addition.
  std::size_t scan_count() const { return scans_.size(); }
  const LidarScan& scan(std::size_t index) const { return std::get<LidarScan>(measurements_[scans_.at(index)]); }

  /// All measurements of one type, in the order of addition.
  template <class One>
  std::vector<const One*> all() const {
    std::vector<const One*> result;
    for (const Measurement& measurement : measurements_) {
      if (const One* one = std::get_if<One>(&measurement)) result.push_back(one);
    }
    return result;
  }

  /// Index of a magnetometer of the platform. Throws InputError with the known names.
  int magnetometer_index(const std::string& name) const;

  /// Copies of the measurements that a run at `site` uses: the same as a reader of logs would give. Throws InputError
  /// if the site has a magnetometer or a LiDAR that the platform of the measurements lacks.
  std::vector<Measurement> used_at(const Site& site) const;

  const std::vector<Measurement>& measurements() const { return measurements_; }

 private:
  Platform platform_;
  std::vector<Measurement> measurements_;
  std::vector<std::size_t> scans_;  ///< their indices
};

/// A scan as arrays: start_ns, end_ns, points_m (N, 3) float32, offset_ns (N,), intensity (N,), ring (N,), lidar (N,).
py::tuple arrays_of(const LidarScan& scan);

}  // namespace lodestone::python

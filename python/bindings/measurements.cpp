#include "bindings/measurements.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "bindings/bindings.h"
#include "core/error.h"
#include "core/nearest_name.h"
#include "frontends/configuration/trajectory_file.h"

namespace lodestone::python {

namespace {

/// A column of a scan that may be missing.
template <class T>
struct OptionalColumn {
  OptionalColumn(const py::object& argument, const char* name, py::ssize_t rows) {
    if (argument.is_none()) return;
    values = column_argument<T>(argument, name);
    require_rows(values, name, rows);
    present = true;
  }
  T at(py::ssize_t row) const { return present ? values.data()[row] : T{}; }

  Array<T> values;
  bool present = false;
};

/// A column of numbers, such as rings, that may be missing. Throws ValueError for a value that T cannot hold.
template <class T>
std::vector<T> numbers_of(const py::object& argument, const char* name, py::ssize_t rows) {
  const OptionalColumn<double> column(argument, name, rows);
  std::vector<T> numbers(static_cast<std::size_t>(rows), 0);
  for (py::ssize_t i = 0; i < rows; ++i) {
    const double value = column.at(i);
    if (!(value >= 0.0 && value <= std::numeric_limits<T>::max() && value == std::floor(value))) {
      throw py::value_error(fmt::format("{}: point {} has {}; expected a whole number, 0 to {}", name, i, value,
                                        std::numeric_limits<T>::max()));
    }
    numbers[static_cast<std::size_t>(i)] = static_cast<T>(value);
  }
  return numbers;
}

/// Offsets of the points. Throws InputError beyond the range of LidarPoint::offset_ns.
std::vector<std::int32_t> offsets_of(const py::object& argument, Time start_ns, py::ssize_t rows) {
  std::vector<std::int32_t> offsets(static_cast<std::size_t>(rows), 0);
  if (argument.is_none()) return offsets;
  const Array<std::int64_t> values = integers_argument(argument, "offset_ns");
  require_rows(values, "offset_ns", rows);
  for (py::ssize_t i = 0; i < rows; ++i) {
    const std::int64_t offset = values.data()[i];
    if (offset < 0 || offset > std::numeric_limits<std::int32_t>::max()) {
      throw InputError(
          fmt::format("scan at {} s: point {} has offset_ns {}; expected its time minus start_ns, 0 to 2.1e9",
                      format_stamp(start_ns), i, offset));
    }
    offsets[static_cast<std::size_t>(i)] = static_cast<std::int32_t>(offset);
  }
  return offsets;
}

std::string size_text(const Measurements& measurements) {
  return fmt::format("<lodestone.Measurements of '{}': {} scans, {} IMU samples, {} field samples, {} wheel samples>",
                     measurements.platform().name, measurements.scan_count(), measurements.all<ImuSample>().size(),
                     measurements.all<MagneticSample>().size(), measurements.all<WheelSample>().size());
}

py::tuple imu_arrays(const Measurements& measurements) {
  const auto samples = measurements.all<ImuSample>();
  return py::make_tuple(
      array_of<std::int64_t>(samples, 1, [](const ImuSample* one, auto* out) { *out = one->time; }),
      array_of<double>(samples, 3, [](const ImuSample* one, double* out) { write_vector(one->angular_velocity, out); }),
      array_of<double>(samples, 3,
                       [](const ImuSample* one, double* out) { write_vector(one->linear_acceleration, out); }));
}

py::tuple field_arrays(const Measurements& measurements, const std::string& name) {
  const int index = measurements.magnetometer_index(name);
  auto samples = measurements.all<MagneticSample>();
  std::erase_if(samples, [&](const MagneticSample* one) { return one->magnetometer != index; });
  return py::make_tuple(
      array_of<std::int64_t>(samples, 1, [](const MagneticSample* one, auto* out) { *out = one->time; }),
      array_of<double>(samples, 3, [](const MagneticSample* one, double* out) { write_vector(one->field_ut, out); }));
}

py::tuple wheel_arrays(const Measurements& measurements) {
  const auto samples = measurements.all<WheelSample>();
  return py::make_tuple(
      array_of<std::int64_t>(samples, 1, [](const WheelSample* one, auto* out) { *out = one->time; }),
      array_of<double>(samples, 1, [](const WheelSample* one, double* out) { *out = one->forward_velocity_m_s; }),
      array_of<double>(samples, 1, [](const WheelSample* one, double* out) { *out = one->lateral_velocity_m_s; }),
      array_of<double>(samples, 1, [](const WheelSample* one, double* out) { *out = one->yaw_rate_rad_s; }));
}

}  // namespace

py::tuple arrays_of(const LidarScan& scan) {
  const auto& points = scan.points;
  auto positions = array_of<float>(points, 3, [](const LidarPoint& one, float* out) {
    for (int i = 0; i < 3; ++i) out[i] = one.position(i);
  });
  return py::make_tuple(
      scan.start, scan.end, std::move(positions),
      array_of<std::int32_t>(points, 1, [](const LidarPoint& one, auto* out) { *out = one.offset_ns; }),
      array_of<float>(points, 1, [](const LidarPoint& one, auto* out) { *out = one.intensity; }),
      array_of<std::uint16_t>(points, 1, [](const LidarPoint& one, auto* out) { *out = one.ring; }),
      array_of<std::uint8_t>(points, 1, [](const LidarPoint& one, auto* out) { *out = one.lidar; }));
}

void Measurements::add_imu(const py::object& stamp_ns, const py::object& gyroscope_rad_s,
                           const py::object& accelerometer_m_s2) {
  const Array<std::int64_t> stamps = integers_argument(stamp_ns, "stamp_ns");
  const Array<double> gyroscope = table_argument<double>(gyroscope_rad_s, "gyroscope_rad_s", 3);
  const Array<double> accelerometer = table_argument<double>(accelerometer_m_s2, "accelerometer_m_s2", 3);
  require_rows(gyroscope, "gyroscope_rad_s", stamps.shape(0));
  require_rows(accelerometer, "accelerometer_m_s2", stamps.shape(0));
  for (py::ssize_t i = 0; i < stamps.shape(0); ++i) {
    add(ImuSample{stamps.at(i), vector_at(gyroscope, i), vector_at(accelerometer, i)});
  }
}

void Measurements::add_field(const std::string& magnetometer, const py::object& stamp_ns, const py::object& field_ut) {
  const int index = magnetometer_index(magnetometer);
  const Array<std::int64_t> stamps = integers_argument(stamp_ns, "stamp_ns");
  const Array<double> field = table_argument<double>(field_ut, "field_ut", 3);
  require_rows(field, "field_ut", stamps.shape(0));
  for (py::ssize_t i = 0; i < stamps.shape(0); ++i) add(MagneticSample{stamps.at(i), index, vector_at(field, i)});
}

void Measurements::add_wheels(const py::object& stamp_ns, const py::object& forward_velocity_m_s,
                              const py::object& yaw_rate_rad_s, const py::object& lateral_velocity_m_s) {
  const Array<std::int64_t> stamps = integers_argument(stamp_ns, "stamp_ns");
  const OptionalColumn<double> forward(forward_velocity_m_s, "forward_velocity_m_s", stamps.shape(0));
  const OptionalColumn<double> yaw_rate(yaw_rate_rad_s, "yaw_rate_rad_s", stamps.shape(0));
  const OptionalColumn<double> lateral(lateral_velocity_m_s, "lateral_velocity_m_s", stamps.shape(0));
  for (py::ssize_t i = 0; i < stamps.shape(0); ++i) {
    add(WheelSample{stamps.at(i), forward.at(i), lateral.at(i), yaw_rate.at(i)});
  }
}

void Measurements::add_scan(Time start_ns, const py::object& points_m, const py::object& offset_ns,
                            const py::object& end_ns, const py::object& intensity, const py::object& ring,
                            const py::object& lidar) {
  const Array<float> positions = table_argument<float>(points_m, "points_m", 3);
  const py::ssize_t count = positions.shape(0);
  const std::vector<std::int32_t> offsets = offsets_of(offset_ns, start_ns, count);
  const OptionalColumn<float> intensities(intensity, "intensity", count);
  const auto rings = numbers_of<std::uint16_t>(ring, "ring", count);
  const auto lidars = numbers_of<std::uint8_t>(lidar, "lidar", count);
  LidarScan scan;
  scan.start = start_ns;
  scan.points.resize(static_cast<std::size_t>(count));
  const float* values = positions.data();
  for (py::ssize_t i = 0; i < count; ++i) {
    LidarPoint& point = scan.points[static_cast<std::size_t>(i)];
    point.position = Eigen::Vector3f(values[3 * i], values[3 * i + 1], values[3 * i + 2]);
    point.offset_ns = offsets[static_cast<std::size_t>(i)];
    point.intensity = intensities.at(i);
    point.ring = rings[static_cast<std::size_t>(i)];
    point.lidar = lidars[static_cast<std::size_t>(i)];
  }
  // As core/measurements.h defines a scan's end.
  const auto largest = std::max_element(offsets.begin(), offsets.end());
  const bool has_times = largest != offsets.end() && *largest > 0;
  scan.end = !end_ns.is_none() ? end_ns.cast<Time>()
             : has_times       ? start_ns + *largest
                               : start_ns + from_seconds(platform_.suite.lidar.scan_period_s);
  add(std::move(scan));
}

int Measurements::magnetometer_index(const std::string& name) const {
  const auto& models = platform_.suite.magnetometers;
  std::vector<std::string> names;
  for (std::size_t i = 0; i < models.size(); ++i) {
    if (models[i].name == name) return static_cast<int>(i);
    names.push_back(models[i].name);
  }
  if (names.empty()) {
    throw InputError(
        fmt::format("{}: there are no magnetometers; add them under 'magnetometers'", platform_.file_name()));
  }
  throw InputError(fmt::format("{}: expected a magnetometer of {}, found '{}'{}", platform_.file_name(),
                               join_names(names), name, suggestion(name, names)));
}

std::vector<Measurement> Measurements::used_at(const Site& site) const {
  const SensorSuite& suite = site.platform.suite;
  if (suite.further_lidars.size() != platform_.suite.further_lidars.size()) {
    throw InputError(
        fmt::format("measurements in memory: their platform has {} LiDARs, that of the site {}; use one platform",
                    platform_.suite.lidars().size(), suite.lidars().size()));
  }
  // Options may choose some of the magnetometers.
  std::vector<int> index_at_site(platform_.suite.magnetometers.size(), -1);
  for (std::size_t k = 0; site.sensors.magnetometers && k < suite.magnetometers.size(); ++k) {
    index_at_site[static_cast<std::size_t>(magnetometer_index(suite.magnetometers[k].name))] = static_cast<int>(k);
  }
  std::vector<Measurement> used;
  used.reserve(measurements_.size());
  for (const Measurement& measurement : measurements_) {
    if (const auto* field = std::get_if<MagneticSample>(&measurement)) {
      const int index = index_at_site[static_cast<std::size_t>(field->magnetometer)];
      if (index >= 0) used.emplace_back(MagneticSample{field->time, index, field->field_ut});
      continue;
    }
    if (std::holds_alternative<LidarScan>(measurement) && !site.sensors.lidar) continue;
    if (std::holds_alternative<WheelSample>(measurement) && !(site.sensors.wheels && suite.wheels)) continue;
    used.push_back(measurement);
  }
  return used;
}

void bind_measurements(py::module_& module) {
  py::class_<Measurements>(module, "Measurements")
      .def(py::init<Platform>(), py::arg("platform"))
      .def("__len__", &Measurements::size)
      .def("__repr__", &size_text)
      .def_property_readonly("platform", &Measurements::platform, "The robot.")
      .def("add_imu", &Measurements::add_imu, py::arg("stamp_ns"), py::arg("gyroscope_rad_s"),
           py::arg("accelerometer_m_s2"),
           R"(Adds samples of the IMU, in the imu frame.

stamp_ns: (N,) integers, nanoseconds.
gyroscope_rad_s: (N, 3) angular velocity, rad/s.
accelerometer_m_s2: (N, 3) specific force, m/s²: about (0, 0, +9.8) at rest with z up.

Raises ValueError for other shapes, and for stamps that are floats.)")
      .def("add_field", &Measurements::add_field, py::arg("magnetometer"), py::arg("stamp_ns"), py::arg("field_ut"),
           R"(Adds readings of one magnetometer, in the magnetometer's frame.

magnetometer: its name in the platform file.
stamp_ns: (N,) integers, nanoseconds, without the clock offset of the platform file.
field_ut: (N, 3) field, µT, corrected for hard and soft iron.

Raises InputError for an unknown name, and ValueError for other shapes.)")
      .def("add_wheels", &Measurements::add_wheels, py::arg("stamp_ns"), py::arg("forward_velocity_m_s"),
           py::arg("yaw_rate_rad_s"), py::arg("lateral_velocity_m_s") = py::none(),
           R"(Adds wheel odometry, in the wheel frame: x forwards, y left, z up.

stamp_ns: (N,) integers, nanoseconds.
forward_velocity_m_s: (N,) m/s.
yaw_rate_rad_s: (N,) rad/s.
lateral_velocity_m_s: (N,) m/s to the left; None: zero.)")
      .def("add_scan", &Measurements::add_scan, py::arg("start_ns"), py::arg("points_m"),
           py::arg("offset_ns") = py::none(), py::arg("end_ns") = py::none(), py::arg("intensity") = py::none(),
           py::arg("ring") = py::none(), py::arg("lidar") = py::none(),
           R"(Adds a scan, in the frame of the (first) LiDAR, not deskewed.

start_ns: time of offset 0, nanoseconds.
points_m: (N, 3) positions, m, each at the point's own time. Remove points that are not finite.
offset_ns: (N,) integers, the point's time minus start_ns. None: the scan is deskewed, all points are of start_ns.
end_ns: end of the scan; None: the latest point, or without offset_ns one scan period after start_ns.
intensity, ring, lidar: (N,). lidar is the index of the LiDAR that measured the point; None: the first.

Raises ValueError for other shapes and for a ring (0 to 65535) or lidar (0 to 255) that is no whole number or out of
range, and InputError for a point before start_ns.)")
      .def("imu_arrays", &imu_arrays)
      .def("field_arrays", &field_arrays, py::arg("magnetometer"))
      .def("wheel_arrays", &wheel_arrays)
      .def(
          "scan_arrays", [](const Measurements& one, std::size_t index) { return arrays_of(one.scan(index)); },
          py::arg("index"))
      .def("scan_count", &Measurements::scan_count);
}

}  // namespace lodestone::python

#include <pybind11/stl.h>

#include "bindings/arrays.h"
#include "bindings/bindings.h"
#include "frontends/configuration/platform.h"

namespace lodestone::python {

namespace {

std::vector<std::string> magnetometer_names(const Platform& platform) {
  std::vector<std::string> names;
  for (const MagnetometerModel& one : platform.suite.magnetometers) names.push_back(one.name);
  return names;
}

py::array_t<double> lidar_poses(const Platform& platform) {
  return array_of<double>(platform.suite.lidars(), 7,
                          [](const LidarModel& one, double* out) { write_pose(one.T_imu_lidar, out); });
}

py::array_t<double> magnetometer_poses(const Platform& platform) {
  return array_of<double>(platform.suite.magnetometers, 7,
                          [](const MagnetometerModel& one, double* out) { write_pose(one.T_imu_mag, out); });
}

}  // namespace

void bind_platforms(py::module_& module) {
  py::class_<Platform>(module, "Platform", "A robot: its sensors, and where a log has them. From load_platform.")
      .def_readonly("name", &Platform::name, "The robot's name.")
      .def_property_readonly("magnetometers", &magnetometer_names, "Names of the magnetometers, in order.")
      .def_property_readonly(
          "T_imu_lidar", &lidar_poses,
          "Poses of the L LiDARs, (L, 7): x, y, z in m, qx, qy, qz, qw. p_imu = T_imu_lidar p_lidar.")
      .def_property_readonly("T_imu_mag", &magnetometer_poses, "Poses of the M magnetometers, (M, 7), as T_imu_lidar.")
      .def_property_readonly(
          "scan_period_s", [](const Platform& one) { return one.suite.lidar.scan_period_s; },
          "Nominal duration of a scan.")
      .def_property_readonly("gravity_m_s2", [](const Platform& one) { return one.suite.gravity_m_s2; })
      .def("save", &save_platform, py::arg("path"), py::arg("comment") = "",
           "Writes a platform file, with `comment` at its beginning. Raises InputError.")
      .def("__repr__", [](const Platform& one) {
        return "<lodestone.Platform '" + one.name + "', " + std::to_string(one.suite.lidars().size()) + " LiDARs, " +
               std::to_string(one.suite.magnetometers.size()) + " magnetometers>";
      });
  module.def(
      "load_platform",
      [](const std::string& path, bool lidar, bool imu, bool magnetometers) {
        return load_platform(path, {lidar, imu, magnetometers, true});
      },
      py::arg("path"), py::arg("lidar"), py::arg("imu"), py::arg("magnetometers"), "Reads a platform file.");
  module.def(
      "parse_platform", [](const std::string& text, const std::string& name) { return parse_platform(text, name); },
      py::arg("text"), py::arg("name"), "Parses the text of a platform file.");
}

}  // namespace lodestone::python

#include "bindings/arrays.h"
#include "bindings/bindings.h"
#include "frontends/configuration/kitti_trajectory.h"
#include "frontends/configuration/text_file.h"
#include "frontends/configuration/trajectory_file.h"

namespace lodestone::python {

namespace {

py::tuple read(const std::string& path, const std::string& times) {
  Trajectory trajectory;
  {
    const py::gil_scoped_release unlocked;
    trajectory = times.empty() ? read_trajectory(path) : read_kitti(path, times);
  }
  return arrays_of(trajectory);
}

std::string tum_lines(const py::object& stamp_ns, const py::object& position_m, const py::object& quaternion_xyzw) {
  std::string text;
  for (const StampedPose& pose : trajectory_argument(stamp_ns, position_m, quaternion_xyzw)) {
    text += format_tum(pose) + "\n";
  }
  return text;
}

/// Poses at `times`; NaN where the trajectory has none.
py::tuple interpolate_at(const py::object& stamp_ns, const py::object& position_m, const py::object& quaternion_xyzw,
                         const py::object& times, double max_gap_s) {
  const Trajectory trajectory = trajectory_argument(stamp_ns, position_m, quaternion_xyzw);
  const Array<std::int64_t> wanted = integers_argument(times, "stamp_ns");
  py::array_t<double> positions({wanted.shape(0), py::ssize_t{3}});
  py::array_t<double> quaternions({wanted.shape(0), py::ssize_t{4}});
  for (py::ssize_t i = 0; i < wanted.shape(0); ++i) {
    const auto pose = interpolate(trajectory, wanted.at(i), from_seconds(max_gap_s));
    for (int k = 0; k < 3; ++k) positions.mutable_at(i, k) = pose ? pose->position(k) : std::nan("");
    for (int k = 0; k < 4; ++k) quaternions.mutable_at(i, k) = pose ? pose->rotation.coeffs()(k) : std::nan("");
  }
  return py::make_tuple(std::move(positions), std::move(quaternions));
}

}  // namespace

void bind_trajectories(py::module_& module) {
  module.def("read_trajectory", &read, py::arg("path"), py::arg("times"),
             "Stamps (N,) int64 ns, positions (N, 3) m and quaternions (N, 4) of a TUM or EuRoC file; with the file "
             "`times`, of a KITTI file.");
  module.def("tum_lines", &tum_lines, py::arg("stamp_ns"), py::arg("position_m"), py::arg("quaternion_xyzw"),
             "Lines of a TUM file.");
  module.def("interpolate", &interpolate_at, py::arg("stamp_ns"), py::arg("position_m"), py::arg("quaternion_xyzw"),
             py::arg("wanted_ns"), py::arg("max_gap_s"),
             "Positions (M, 3) and quaternions (M, 4) at wanted_ns; NaN where the trajectory has no pose.");
  module.def("format_stamp", &format_stamp, py::arg("stamp_ns"), "Seconds with nine decimals, exact.");
  module.def(
      "write_text_file", [](const std::string& path, const std::string& text) { write_text_file(path, text); },
      py::arg("path"), py::arg("text"), "Writes under a temporary name and renames.");
}

}  // namespace lodestone::python

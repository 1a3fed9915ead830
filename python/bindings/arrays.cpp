#include "bindings/arrays.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "core/error.h"
#include "frontends/configuration/trajectory_file.h"

namespace lodestone::python {

namespace {

/// As files of trajectories are read. `where` names the pose in messages.
Pose checked_pose(const Vector3& position, const Quaternion& rotation, const std::string& where) {
  constexpr double tolerance = 0.01;
  const double length = rotation.norm();
  if (!position.allFinite() || !std::isfinite(length)) {
    throw InputError(where + ": a value is not finite; remove such poses");
  }
  if (std::abs(length - 1.0) > tolerance) {
    throw InputError(
        fmt::format("{}: the quaternion's length is {:.4g}; expected 1, in the order x, y, z, w", where, length));
  }
  // A quaternion of unit length keeps its bits.
  constexpr double rounding = 8.0 * std::numeric_limits<double>::epsilon();
  return {std::abs(length - 1.0) <= rounding ? rotation : rotation.normalized(), position};
}

}  // namespace

void refuse_shape(const char* name, const std::string& expected, const py::array& found) {
  const std::string shape = py::str(found.attr("shape"));
  throw py::value_error(std::string(name) + ": expected shape " + expected + ", found " + shape);
}

Array<std::int64_t> integers_argument(const py::handle& argument, const char* name) {
  const auto given = py::array::ensure(argument);
  if (!given) throw py::value_error(std::string(name) + ": expected an array of integers");
  const bool is_empty = given.size() == 0;
  if (given.dtype().kind() != 'i' && given.dtype().kind() != 'u' && !is_empty) {
    const std::string type = py::str(given.dtype());
    throw py::value_error(std::string(name) + ": expected integers, nanoseconds, found " + type +
                          "; convert seconds t by numpy.round(1e9 * t).astype(numpy.int64)");
  }
  if (given.dtype().kind() == 'u') {
    const auto values = column_argument<std::uint64_t>(given, name);
    for (py::ssize_t i = 0; i < values.shape(0); ++i) {
      if (values.data()[i] > static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max())) {
        throw py::value_error(fmt::format("{}: value {} is {}; expected at most {}", name, i, values.data()[i],
                                          std::numeric_limits<std::int64_t>::max()));
      }
    }
  }
  return column_argument<std::int64_t>(given, name);
}

void require_rows(const py::array& array, const char* name, py::ssize_t rows) {
  if (array.shape(0) == rows) return;
  throw py::value_error(
      fmt::format("{}: expected {} rows, as many as stamps or points, found {}", name, rows, array.shape(0)));
}

py::array_t<double> array_of(const Vector3& vector) {
  py::array_t<double> array(3);
  write_vector(vector, array.mutable_data());
  return array;
}

Pose pose_argument(const py::handle& argument, const char* name) {
  const Array<double> values = column_argument<double>(argument, name);
  if (values.size() != 7) refuse_shape(name, "(7,): x, y, z, qx, qy, qz, qw", values);
  const double* v = values.data();
  return checked_pose({v[0], v[1], v[2]}, Quaternion(v[6], v[3], v[4], v[5]), name);
}

Trajectory trajectory_argument(const py::handle& stamp_ns, const py::handle& position_m,
                               const py::handle& quaternion_xyzw) {
  const Array<std::int64_t> stamps = integers_argument(stamp_ns, "stamp_ns");
  const Array<double> positions = table_argument<double>(position_m, "position_m", 3);
  const Array<double> quaternions = table_argument<double>(quaternion_xyzw, "quaternion_xyzw", 4);
  require_rows(positions, "position_m", stamps.shape(0));
  require_rows(quaternions, "quaternion_xyzw", stamps.shape(0));
  Trajectory trajectory;
  trajectory.reserve(static_cast<std::size_t>(stamps.shape(0)));
  for (py::ssize_t i = 0; i < stamps.shape(0); ++i) {
    const Time time = stamps.at(i);
    const std::string where = fmt::format("pose {} at {} s", i, format_stamp(time));
    if (!trajectory.empty() && time < trajectory.back().time) {
      throw InputError(where + ": the stamp goes back; sort the poses by time");
    }
    const double* q = quaternions.data(i, 0);
    trajectory.push_back({time, checked_pose(vector_at(positions, i), Quaternion(q[3], q[0], q[1], q[2]), where)});
  }
  return trajectory;
}

py::tuple arrays_of(const Trajectory& trajectory) {
  auto stamps = array_of<std::int64_t>(trajectory, 1, [](const StampedPose& one, auto* out) { *out = one.time; });
  auto positions = array_of<double>(trajectory, 3,
                                    [](const StampedPose& one, double* out) { write_vector(one.pose.position, out); });
  auto quaternions = array_of<double>(trajectory, 4, [](const StampedPose& one, double* out) {
    for (int i = 0; i < 4; ++i) out[i] = one.pose.rotation.coeffs()(i);
  });
  return py::make_tuple(std::move(stamps), std::move(positions), std::move(quaternions));
}

}  // namespace lodestone::python

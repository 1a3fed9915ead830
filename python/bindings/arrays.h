#pragma once

#include <pybind11/numpy.h>

#include <cstdint>
#include <string>

#include "core/geometry/trajectory.h"

/// Arguments and results of functions as numpy arrays.
namespace lodestone::python {

namespace py = pybind11;

/// A C-contiguous array. Arguments of another layout or number type are converted.
template <class T>
using Array = py::array_t<T, py::array::c_style | py::array::forcecast>;

/// Throws ValueError: "NAME: expected shape EXPECTED, found (2, 4)".
[[noreturn]] void refuse_shape(const char* name, const std::string& expected, const py::array& found);

/// `argument` as an array of shape (N,). Throws ValueError for another shape, or if the values are no numbers.
template <class T>
Array<T> column_argument(const py::handle& argument, const char* name) {
  auto array = Array<T>::ensure(argument);
  if (!array) throw py::value_error(std::string(name) + ": expected an array of numbers");
  if (array.ndim() != 1) refuse_shape(name, "(N,)", array);
  return array;
}

/// `argument` as an array of shape (N, columns). Throws ValueError.
template <class T>
Array<T> table_argument(const py::handle& argument, const char* name, py::ssize_t columns) {
  auto array = Array<T>::ensure(argument);
  if (!array) throw py::value_error(std::string(name) + ": expected an array of numbers");
  if (array.ndim() != 2 || array.shape(1) != columns) {
    refuse_shape(name, "(N, " + std::to_string(columns) + ")", array);
  }
  return array;
}

/// `argument` as an array of whole numbers of shape (N,). Throws ValueError for floats: a stamp in seconds has lost its
/// nanoseconds. Throws it, too, for values from 2^63.
Array<std::int64_t> integers_argument(const py::handle& argument, const char* name);

/// Throws ValueError unless `array` has `rows` rows.
void require_rows(const py::array& array, const char* name, py::ssize_t rows);

/// An array of shape (N, columns), or (N,) for one column: `write(row, values)` writes the values of each of `rows`.
template <class T, class Rows, class Write>
py::array_t<T> array_of(const Rows& rows, py::ssize_t columns, const Write& write) {
  const auto count = static_cast<py::ssize_t>(rows.size());
  py::array_t<T> array = columns == 1 ? py::array_t<T>(count) : py::array_t<T>({count, columns});
  T* values = array.mutable_data();
  for (const auto& row : rows) {
    write(row, values);
    values += columns;
  }
  return array;
}

inline void write_vector(const Vector3& vector, double* values) {
  for (int i = 0; i < 3; ++i) values[i] = vector(i);
}

/// x, y, z, qx, qy, qz, qw.
inline void write_pose(const Pose& pose, double* values) {
  write_vector(pose.position, values);
  for (int i = 0; i < 4; ++i) values[3 + i] = pose.rotation.coeffs()(i);
}

inline Vector3 vector_at(const Array<double>& table, py::ssize_t row) {
  return {table.at(row, 0), table.at(row, 1), table.at(row, 2)};
}

/// x, y, z of a vector as an array of shape (3,).
py::array_t<double> array_of(const Vector3& vector);

/// The pose of x, y, z, qx, qy, qz, qw. Throws ValueError for another shape, InputError if the quaternion is far from
/// unit length.
Pose pose_argument(const py::handle& argument, const char* name);

/// The trajectory of stamps (N,), positions (N, 3) and quaternions (N, 4). Throws ValueError for other shapes, and
/// InputError if stamps decrease, a value is not finite, or a quaternion is far from unit length.
Trajectory trajectory_argument(const py::handle& stamp_ns, const py::handle& position_m,
                               const py::handle& quaternion_xyzw);

/// Stamps (N,), positions (N, 3) and quaternions (N, 4).
py::tuple arrays_of(const Trajectory& trajectory);

}  // namespace lodestone::python

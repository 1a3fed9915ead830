#pragma once

#include <pybind11/pybind11.h>

/// The compiled module lodestone._lodestone: numpy arrays in and out. The package lodestone around it, in Python, has
/// the classes and functions for users (docs/user/python.md).
namespace lodestone::python {

namespace py = pybind11;

void bind_trajectories(py::module_& module);
void bind_platforms(py::module_& module);
void bind_measurements(py::module_& module);
void bind_logs(py::module_& module);
void bind_field_maps(py::module_& module);
void bind_field_surveys(py::module_& module);
void bind_cloud_maps(py::module_& module);
void bind_sites(py::module_& module);
void bind_localization(py::module_& module);
void bind_evaluation(py::module_& module);

}  // namespace lodestone::python

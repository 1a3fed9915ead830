#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <cmath>
#include <optional>

#include "bindings/arrays.h"
#include "bindings/bindings.h"
#include "core/error.h"
#include "frontends/configuration/options.h"
#include "frontends/maps/magnetic_map_file.h"

namespace lodestone::python {

namespace {

MagneticMap map_of_nodes(const py::object& nodes, double resolution_m, const py::object& origin_m,
                         const std::vector<double>& heights_m, std::optional<double> max_sigma_ut) {
  const auto values = Array<float>::ensure(nodes);
  if (!values || values.ndim() != 4 || values.shape(3) != 4) {
    refuse_shape("nodes", "(layers, rows, columns, 4)", py::array::ensure(nodes));
  }
  if (static_cast<std::size_t>(values.shape(0)) != heights_m.size()) {
    throw py::value_error("heights_m: expected one height for each layer of nodes");
  }
  const Array<double> origin = column_argument<double>(origin_m, "origin_m");
  if (origin.size() != 2) refuse_shape("origin_m", "(2,)", origin);
  FieldGrid grid{resolution_m,
                 {origin.at(0), origin.at(1)},
                 static_cast<int>(values.shape(2)),
                 static_cast<int>(values.shape(1)),
                 heights_m};
  const auto count = static_cast<std::size_t>(values.size() / 4);
  std::vector<Eigen::Vector4f> list(count);
  for (std::size_t i = 0; i < count; ++i) list[i] = Eigen::Map<const Eigen::Vector4f>(values.data() + 4 * i);
  return {std::move(grid), list, max_sigma_ut.value_or(std::numeric_limits<double>::infinity())};
}

/// Field (N, 3), gradient (N, 3, 3) and sigma (N,); NaN where the map has no field.
py::tuple query(const MagneticMap& map, const py::object& position_m, const std::string& interpolation) {
  const FieldInterpolation kind = enumerator_of<FieldInterpolation>("interpolation", interpolation);
  const Array<double> positions = table_argument<double>(position_m, "position_m", 3);
  const py::ssize_t count = positions.shape(0);
  py::array_t<double> field({count, py::ssize_t{3}});
  py::array_t<double> gradient({count, py::ssize_t{3}, py::ssize_t{3}});
  py::array_t<double> sigma(count);
  double* field_out = field.mutable_data();
  double* gradient_out = gradient.mutable_data();
  double* sigma_out = sigma.mutable_data();
  const double* position = positions.data();
  {
    const py::gil_scoped_release unlocked;
    for (py::ssize_t i = 0; i < count; ++i) {
      const auto value = map.query({position[3 * i], position[3 * i + 1], position[3 * i + 2]}, kind);
      for (int r = 0; r < 3; ++r) {
        field_out[3 * i + r] = value ? value->field_ut(r) : std::nan("");
        for (int c = 0; c < 3; ++c) gradient_out[9 * i + 3 * r + c] = value ? value->gradient(r, c) : std::nan("");
      }
      sigma_out[i] = value ? value->sigma_ut : std::nan("");
    }
  }
  return py::make_tuple(std::move(field), std::move(gradient), std::move(sigma));
}

py::array_t<float> nodes_of(const MagneticMap& map) {
  const FieldGrid& grid = map.grid();
  py::array_t<float> array({static_cast<py::ssize_t>(grid.heights_m.size()), static_cast<py::ssize_t>(grid.rows),
                            static_cast<py::ssize_t>(grid.columns), py::ssize_t{4}});
  float* out = array.mutable_data();
  const py::gil_scoped_release unlocked;
  for (const Eigen::Vector4f& node : map.nodes()) {
    for (int i = 0; i < 4; ++i) *out++ = node(i);
  }
  return array;
}

void write(const MagneticMap& map, const std::filesystem::path& path, const py::dict& provenance, int tile_nodes) {
  if (path.extension() != ".yaml") throw InputError(path.string() + ": expected a name that ends with .yaml");
  Provenance entries;
  for (const auto& [name, value] : provenance) entries.emplace_back(py::str(name), py::str(value));
  const py::gil_scoped_release unlocked;
  write_magnetic_map(map, entries, path.string(), tile_nodes);
}

std::string text_of(const MagneticMap& map) {
  const FieldGrid& grid = map.grid();
  return "<lodestone.MagneticMap, " + std::to_string(grid.heights_m.size()) + " x " + std::to_string(grid.rows) +
         " x " + std::to_string(grid.columns) + " nodes>";
}

}  // namespace

void bind_field_maps(py::module_& module) {
  py::class_<MagneticMap, std::shared_ptr<MagneticMap>>(module, "MagneticMap",
                                                        R"(A map of the magnetic field on a regular grid.

MagneticMap(nodes, resolution_m, origin_m, heights_m, max_sigma_ut=None)

nodes: (layers, rows, columns, 4) float32: B_x, B_y, B_z along the map's axes and sigma, µT. NaN: no field.
    Rows are along y, columns along x.
resolution_m: spacing of the nodes, m.
origin_m: (2,) map x and y of node (0, 0).
heights_m: map z of each layer, increasing.
max_sigma_ut: there is no field where sigma exceeds this value, µT; None: no limit.

Raises ValueError for other shapes.)")
      .def(py::init(&map_of_nodes), py::arg("nodes"), py::arg("resolution_m"), py::arg("origin_m"),
           py::arg("heights_m"), py::arg("max_sigma_ut") = py::none())
      .def("query", &query, py::arg("position_m"), py::arg("interpolation") = "bicubic",
           R"(The field at points: a tuple of field_ut, gradient_ut_m and sigma_ut.

position_m: (N, 3) map frame, m.
interpolation: "bicubic" or "bilinear".

field_ut: (N, 3) along the map's axes, µT.
gradient_ut_m: (N, 3, 3) dB_i/dx_j, µT/m.
sigma_ut: (N,) one sigma of a component, µT.
All are NaN where the map has no field. Between layers the field is linear; beyond the lowest and the highest layer,
that layer is used. Raises ValueError for another shape.)")
      .def("nodes", &nodes_of, "All nodes, (layers, rows, columns, 4) float32, as in the constructor.")
      .def_property_readonly("resolution_m", [](const MagneticMap& map) { return map.grid().resolution_m; })
      .def_property_readonly("origin_m",
                             [](const MagneticMap& map) { return py::array_t<double>(2, map.grid().origin.data()); })
      .def_property_readonly("heights_m", [](const MagneticMap& map) { return map.grid().heights_m; })
      .def_property_readonly(
          "shape",
          [](const MagneticMap& map) {
            return py::make_tuple(map.grid().heights_m.size(), map.grid().rows, map.grid().columns);
          },
          "Numbers of layers, rows (along y) and columns (along x).")
      .def_property_readonly("max_sigma_ut", &MagneticMap::max_sigma_ut)
      .def_property_readonly(
          "error_correlation_m", [](const MagneticMap& map) { return map.errors().correlation_m; },
          "Correlation length of the map's error, m; 0: unknown.")
      .def_property_readonly(
          "height_sigma_m",
          [](const MagneticMap& map) -> std::optional<double> {
            const double sigma_m = map.errors().height_sigma_m;
            return sigma_m < 0.0 ? std::nullopt : std::optional(sigma_m);
          },
          "How much the height of the survey varied, m; None: unknown, or several layers.")
      .def("write", &write, py::arg("path"), py::arg("provenance") = py::dict(), py::arg("tile_nodes") = 64,
           R"(Writes PATH.yaml, and PATH.tif beside it.

provenance: dict of texts that the file keeps, such as the origin of the map.
tile_nodes: side of the image's tiles, a multiple of 16.

Raises InputError if this fails.)")
      .def("__repr__", &text_of);
  module.def(
      "read_magnetic_map",
      [](const std::filesystem::path& path, std::size_t max_bytes) {
        return std::make_shared<MagneticMap>(read_magnetic_map(path.string(), max_bytes));
      },
      py::arg("path"), py::arg("max_bytes") = default_magnetic_map_bytes, py::call_guard<py::gil_scoped_release>(),
      R"(Opens a magnetic map, YAML and image. Nodes are read on demand; up to max_bytes of them stay in memory.

Raises InputError if a file is missing or malformed.)");
}

}  // namespace lodestone::python

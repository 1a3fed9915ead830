#include <pybind11/stl.h>

#include <array>
#include <filesystem>

#include "bindings/bindings.h"
#include "core/error.h"
#include "frontends/configuration/options.h"
#include "localization/site.h"

namespace lodestone::python {

namespace {

/// Name of a map without a file, for messages.
constexpr const char* map_in_memory = "the magnetic map in memory";

/// `field`: a map in memory, null: files.magnetic.
std::shared_ptr<Site> load(const Platform& platform, MapFiles files, const std::shared_ptr<MagneticMap>& field,
                           const std::vector<std::string>& settings, const std::vector<std::string>& configurations,
                           std::optional<double> max_range_m) {
  RunOptions options;
  load_options(load_configuration(configurations, settings), options);
  if (field != nullptr) files.magnetic = map_in_memory;
  auto site = std::make_shared<Site>(site_without_maps(platform, options, files, max_range_m));
  if (!files.cloud.empty()) load_cloud(*site, std::filesystem::temp_directory_path().string());
  if (field != nullptr) {
    if (platform.magnetometers.empty()) {
      throw InputError(platform.file_name() +
                       ": there are no magnetometers; add them under 'magnetometers', or load the "
                       "site without a magnetic map");
    }
    site->field = field;
  } else if (!files.magnetic.empty()) {
    load_field(*site);
  }
  return site;
}

}  // namespace

void bind_sites(py::module_& module) {
  py::class_<Site, std::shared_ptr<Site>>(module, "Site",
                                          "Robot, options and maps of a site. Any number of logs and estimators, also "
                                          "in several threads, can share a site. From load_site.")
      .def_readonly("platform", &Site::platform, "The robot, with the magnetometers that are used.")
      .def_property_readonly(
          "options", [](const Site& site) { return save_options(site.options); },
          "All options as the text of a configuration file.")
      .def_property_readonly(
          "magnetic_map", [](const Site& site) { return std::const_pointer_cast<MagneticMap>(site.field); },
          "The magnetic map, or None.")
      .def("__repr__", [](const Site& site) {
        return "<lodestone.Site of '" + site.platform.name + "', cloud '" + site.files.cloud + "', magnetic '" +
               site.files.magnetic + "'>";
      });
  module.def(
      "load_site",
      [](const Platform& platform, const std::string& cloud, const std::string& magnetic,
         const std::shared_ptr<MagneticMap>& field, const std::vector<std::string>& settings,
         const std::vector<std::string>& configurations, std::optional<double> max_range_m,
         const std::array<double, 3>& origin_m) {
        const py::gil_scoped_release unlocked;
        return load(platform, {cloud, magnetic, Vector3(origin_m.data())}, field, settings, configurations,
                    max_range_m);
      },
      py::arg("platform"), py::arg("cloud"), py::arg("magnetic"), py::arg("field"), py::arg("settings"),
      py::arg("configurations"), py::arg("max_range_m"), py::arg("origin_m"));
  module.def(
      "list_options", []() { return list_options(RunOptions{}); },
      "All options of a run: one line for each, with default, type and meaning.");
}

}  // namespace lodestone::python

#include "bindings/bindings.h"
#include "core/error.h"

PYBIND11_MODULE(_lodestone, module) {
  using namespace lodestone::python;
  module.doc() = "The compiled part of lodestone. Use the package lodestone.";
  module.attr("__version__") = LODESTONE_VERSION;
  const auto& error = py::register_exception<lodestone::InputError>(module, "InputError", PyExc_ValueError);
  error.attr("__doc__") = "Wrong input. The text is one line: file, topic or key, expectation, content and remedy.";
  bind_trajectories(module);
  bind_platforms(module);
  bind_measurements(module);
  bind_logs(module);
  bind_field_maps(module);
  bind_field_surveys(module);
  bind_cloud_maps(module);
  bind_sites(module);
  bind_localization(module);
  bind_evaluation(module);
  // Where users import them from.
  for (const char* name : {"InputError", "Platform", "Site", "MagneticMap"}) {
    module.attr(name).attr("__module__") = "lodestone";
  }
}

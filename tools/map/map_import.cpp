#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <filesystem>
#include <memory>

#include "core/error.h"
#include "frontends/configuration/options.h"
#include "frontends/maps/field_import.h"
#include "frontends/maps/magnetic_map_file.h"
#include "tools/command_files.h"
#include "tools/commands.h"
#include "tools/plotting/pictures.h"
#include "tools/progress.h"
#include "tools/writers/output_folder.h"

namespace lodestone {
namespace {

struct MapImportCall {
  std::string table;
  std::string out;
  std::string unit;
  std::optional<double> height_m;
  double sigma_ut = 1.0;
  bool force = false;
};

FieldImportOptions options_of(const MapImportCall& call) {
  FieldImportOptions options;
  options.height_m = call.height_m;
  options.sigma_ut = call.sigma_ut;
  if (!(call.sigma_ut > 0.0) || !std::isfinite(call.sigma_ut)) {
    throw InputError(fmt::format("--sigma-ut: expected microtesla above 0, found {}", call.sigma_ut));
  }
  if (call.height_m && !std::isfinite(*call.height_m)) {
    throw InputError(fmt::format("--height: expected metres, found {}", *call.height_m));
  }
  if (!call.unit.empty()) options.unit = enumerator_of<FieldUnit>("--unit", call.unit);
  return options;
}

void map_import(const MapImportCall& call) {
  const std::filesystem::path out = yaml_output(call.out);
  refuse_to_replace(call.out, call.force, {".tif", ".png"});
  const ImportedField field = import_field_table(call.table, options_of(call));
  throw_if_interrupted();
  const FieldGrid& grid = field.map.grid();
  const std::string unit = options_detail::write_value(field.unit);
  fmt::print("{}: {} nodes with field of {} x {} every {:.4g} m, {}\n", call.table, field.nodes, grid.columns,
             grid.rows, grid.resolution_m, heights_text(grid));
  if (field.metres_in_doubt) {
    fmt::print(
        "warning: map.metres (1 times): positions are read as metres: {:g} m along x and {:g} m along y. If they "
        "are "
        "millimetres, divide them by 1000. If they are metres, name the columns x_m, y_m and z_m\n",
        grid.resolution_m * (grid.columns - 1), grid.resolution_m * (grid.rows - 1));
  }
  fmt::print("unit {}{}: half of the field is above {:.3g} uT\n", unit,
             field.unit_from_size ? ", detected from the field's magnitude (set --unit to change)" : "",
             field.median_ut);
  if (!field.has_sigma) {
    fmt::print("no column of sigma: {:g} uT for every node (set --sigma-ut to change)\n", call.sigma_ut);
  }
  if (field.in_cells < field.nodes) {
    fmt::print("warning: {} nodes have no complete grid square: there is no field around them\n",
               field.nodes - field.in_cells);
  }
  const Provenance provenance{
      {"made_by", "lodestone map import"},
      {"table", std::filesystem::path(call.table).filename().string()},
      {"unit_of_table", unit},
      {"sigma", field.has_sigma ? "the table's" : fmt::format("{:g} uT, given", call.sigma_ut)}};
  write_magnetic_map(field.map, provenance, call.out);
  const std::filesystem::path picture = std::filesystem::path(out).replace_extension(".png");
  draw_map_picture(picture, &field.map, {}, {});
  fmt::print("wrote {}, {} and {}\n", call.out, std::filesystem::path(out).replace_extension(".tif").string(),
             picture.string());
}

}  // namespace

void add_map_import(CLI::App& map) {
  const auto call = std::make_shared<MapImportCall>();
  CLI::App* command = map.add_subcommand(
      "import", "Build a magnetic map from another program's table of grid positions and field vectors");
  CommandFiles files(*command);
  files
      .input(command->add_option("TABLE", call->table,
                                 "CSV of x, y, z (m), Bx, By, Bz along the map's axes, and optionally sigma"))
      ->required();
  files
      .output(command->add_option("--out", call->out, "FIELD.yaml; FIELD.tif and FIELD.png are written next to it"),
              CommandFiles::with_endings({".tif", ".png"}))
      ->required();
  command->add_flag("--force", call->force, "replace the files if they exist");
  command
      ->add_option("--unit", call->unit,
                   "unit of the field (default: from the header, or detected from the field's magnitude)")
      ->check(CLI::IsMember(options_detail::names_of(FieldUnit{})));
  command->add_option("--height", call->height_m, "z of the map, metres, if the table has no z");
  command
      ->add_option("--sigma-ut", call->sigma_ut,
                   "sigma of the field at every node, if the table has no sigma, microtesla")
      ->capture_default_str();
  command->footer(R"(
Examples:
  lodestone map import field.csv --out /tmp/imported/field.yaml
  lodestone map import field.csv --out /tmp/imported/field.yaml --unit nanotesla --sigma-ut 0.5)");
  command->callback([call] { map_import(*call); });
}

}  // namespace lodestone

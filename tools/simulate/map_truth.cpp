#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>

#include "core/magnetometer/sparse_field_nodes.h"
#include "core/parallel.h"
#include "frontends/maps/magnetic_map_file.h"
#include "tools/command_files.h"
#include "tools/commands.h"
#include "tools/progress.h"
#include "tools/simulate/magnetic_field.h"
#include "tools/simulate/world.h"
#include "tools/writers/output_folder.h"

namespace lodestone {
namespace {

struct MapTruthCall {
  std::string world;
  std::string like;
  std::string out;
  std::string scene;
  std::vector<std::string> settings;
  bool force = false;
};

void map_truth(const MapTruthCall& call) {
  yaml_output(call.out);
  refuse_to_replace(call.out, call.force, {".tif"});
  const simulation::World world = simulation::load_world(call.world, call.settings);
  const MagneticMap like = read_magnetic_map(call.like);
  const simulation::MagneticField field(world.earth_field_ut, simulation::build_scene(world, call.scene).sources);

  const FieldGrid& grid = like.grid();
  const auto nodes = std::make_shared<SparseFieldNodes>();
  std::int64_t count = 0;
  std::vector<Eigen::Vector4f> row_nodes(static_cast<std::size_t>(grid.columns));
  for (int layer = 0; layer < static_cast<int>(grid.heights_m.size()); ++layer) {
    for (int row = 0; row < grid.rows; ++row) {
      throw_if_interrupted();
      parallel_for(0, grid.columns, [&](int column) {
        Eigen::Vector4f& node = row_nodes[static_cast<std::size_t>(column)];
        node = like.node(layer, row, column);
        if (!(node[3] <= like.max_sigma_ut())) return;
        const Vector3 place(grid.origin.x() + grid.resolution_m * column, grid.origin.y() + grid.resolution_m * row,
                            grid.heights_m[static_cast<std::size_t>(layer)]);
        node << field.field_ut(place).cast<float>(), 0.0F;
      });
      for (int column = 0; column < grid.columns; ++column) {
        const Eigen::Vector4f& node = row_nodes[static_cast<std::size_t>(column)];
        if (!(node[3] == 0.0F)) continue;
        nodes->set(layer, row, column, node);
        ++count;
      }
    }
  }
  const Provenance provenance{{"made_by", "lodestone map truth"},
                              {"world", std::filesystem::path(call.world).filename().string()},
                              {"scene", call.scene.empty() ? "none" : call.scene},
                              {"nodes_of", std::filesystem::path(call.like).filename().string()}};
  constexpr std::size_t cache_bytes = 16U << 20U;
  write_magnetic_map(MagneticMap(grid, nodes, like.max_sigma_ut(), cache_bytes), provenance, call.out);
  fmt::print("wrote {}: the field of {} at {} nodes\n", call.out, call.world, count);
}

}  // namespace

void add_map_truth(CLI::App& map) {
  const auto call = std::make_shared<MapTruthCall>();
  CLI::App* command = map.add_subcommand(
      "truth", "Write a simulated world's true field at the nodes of a map; `map diff` then gives the map's error");
  CommandFiles files(*command);
  files.input(command->add_option("WORLD", call->world, "world file (config/worlds/)"))->required();
  files
      .input(
          command->add_option("--like", call->like, "a magnetic map, FIELD.yaml: its grid, and its nodes with field"))
      ->required();
  files
      .output(command->add_option("--out", call->out, "TRUTH.yaml; TRUTH.tif is written beside it; sigma is 0"),
              CommandFiles::with_endings({".tif"}))
      ->required();
  command->add_flag("--force", call->force, "replace the files if they exist");
  command->add_option("--scene", call->scene, "scene of the world (default: the permanent solids alone)");
  command->add_option("--set", call->settings, "change a key of the world, as for simulate");
  command->footer(R"(
Examples, on what `lodestone simulate tunnel --out /tmp/tunnel` and `lodestone map magnetic` write:
  lodestone map truth config/worlds/tunnel.yaml --like /tmp/tunnel/field.yaml --out /tmp/tunnel/true_field.yaml
  lodestone map diff /tmp/tunnel/true_field.yaml /tmp/tunnel/field.yaml --out /tmp/tunnel/map_error)");
  command->callback([call] { map_truth(*call); });
}

}  // namespace lodestone

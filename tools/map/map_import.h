#pragma once

namespace CLI {
class App;
}

namespace lodestone {

/// Adds `map import`, which builds a magnetic map from a table. See tools/commands.h.
void add_map_import(CLI::App& map, int* code);

}  // namespace lodestone

#pragma once

namespace CLI {
class App;
}

namespace lodestone {

/// Adds `map import`, which makes a magnetic map of a table that others wrote, to `map`; see tools/commands.h.
void add_map_import(CLI::App& map, int* code);

}  // namespace lodestone

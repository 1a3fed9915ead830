#pragma once

namespace CLI {
class App;
}

namespace lodestone {

/// Adds `map diff`, which compares two magnetic maps. See tools/commands.h.
void add_map_diff(CLI::App& map, int* code);

}  // namespace lodestone

#pragma once

namespace CLI {
class App;
}

namespace lodestone {

/// Adds `map cloud`, which builds a cloud map from survey drives. See tools/commands.h.
void add_map_cloud(CLI::App& map, int* code);

}  // namespace lodestone

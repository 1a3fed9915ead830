#pragma once

namespace CLI {
class App;
}

namespace lodestone {

/// Adds `map truth` to `map`: it writes a simulated world's true field at a map's nodes. See tools/commands.h.
void add_map_truth(CLI::App& map, int* code);

}  // namespace lodestone

#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace lodestone {

/// Throws InputError where a file that a call writes, under the name given or one that follows from it (field.tif beside
/// field.yaml), is there and is one that the same call reads, or a part of one. `name`: the command with the words that lead to
/// it, "lodestone map truth"; `words`: what follows them.
void check_outputs_apart(const CLI::App& command, const std::string& name, const std::vector<std::string>& words);

}  // namespace lodestone

#pragma once

#include <string>

namespace CLI {
class App;
}

namespace lodestone {

/// The manual page lodestone(1) of all commands and their options, as man(7) source. `version`: for its footer.
std::string man_page(const CLI::App& program, const std::string& version);

/// Completion of commands, options and values for bash: a script for share/bash-completion/completions.
std::string bash_completion(const CLI::App& program);

}  // namespace lodestone

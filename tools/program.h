#pragma once

#include <string>

namespace lodestone {

/// Parses the command line, runs the subcommand and maps every failure to its exit code (docs/design/architecture.md).
/// `revision`: of the source tree, for --version.
int run_program(int argument_count, char** arguments, const std::string& revision);

}  // namespace lodestone

#pragma once

namespace lodestone {

/// Parses the command line, runs the subcommand and maps every failure to its exit code (docs/design/architecture.md).
int run_program(int argument_count, char** arguments);

}  // namespace lodestone

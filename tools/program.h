#pragma once

namespace lodestone {

/// Parses the command line, runs the subcommand and maps every failure to its exit code (design.md, section 11).
int run_program(int argument_count, char** arguments);

}  // namespace lodestone

#include <CLI/CLI.hpp>

#include "tools/commands.h"

namespace lodestone {

void add_run_command(CLI::App& app, int* code) { (void)app, (void)code; }

}  // namespace lodestone

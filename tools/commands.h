#pragma once

#include <string>

namespace CLI {
class App;
}

namespace lodestone {

/// Exit codes of the program; scripts rely on them (docs/design/architecture.md).
namespace exit_code {
constexpr int done = 0;
constexpr int input_error = 2;
constexpr int track_lost = 3;
constexpr int interrupted = 130;
}  // namespace exit_code

/// Each function adds its subcommand to `app`. A command that can end in several ways stores its exit code in `*code`.
/// Commands throw InputError for wrong input; main turns the error into one line and exit code 2.
void add_simulate_command(CLI::App& app);
void add_convert_command(CLI::App& app);
void add_shift_command(CLI::App& app);
void add_init_command(CLI::App& app);
void add_check_command(CLI::App& app, int* code);
void add_map_command(CLI::App& app);
void add_calibrate_command(CLI::App& app);
void add_run_command(CLI::App& app, int* code);
void add_evaluate_command(CLI::App& app);
void add_report_command(CLI::App& app);
void add_export_command(CLI::App& app);
void add_reproduce_command(CLI::App& app, int* code);
void add_ablate_command(CLI::App& app, int* code);
/// Subcommands of `map`.
void add_map_cloud(CLI::App& map);
void add_map_import(CLI::App& map);
void add_map_diff(CLI::App& map);
void add_map_truth(CLI::App& map);
/// `version`: of the program, for the manual page.
void add_manual_command(CLI::App& app, const std::string& version);

}  // namespace lodestone

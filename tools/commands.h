#pragma once

namespace CLI {
class App;
}

namespace lodestone {

/// Exit codes of the program, a contract that scripts rely on (docs/design/architecture.md).
namespace exit_code {
constexpr int done = 0;
constexpr int input_error = 2;
constexpr int track_lost = 3;
constexpr int interrupted = 130;
}  // namespace exit_code

/// Each adds its subcommand to `app`; when the subcommand was chosen and ran, it stores its exit code in `*code`.
/// Commands throw InputError for wrong input; main turns that into one line and exit code 2.
void add_simulate_command(CLI::App& app, int* code);
void add_convert_command(CLI::App& app, int* code);
void add_check_command(CLI::App& app, int* code);
void add_map_command(CLI::App& app, int* code);
void add_calibrate_command(CLI::App& app, int* code);
void add_run_command(CLI::App& app, int* code);
void add_evaluate_command(CLI::App& app, int* code);
void add_report_command(CLI::App& app, int* code);
void add_reproduce_command(CLI::App& app, int* code);
void add_ablate_command(CLI::App& app, int* code);

}  // namespace lodestone

#include "tools/program.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <exception>
#include <new>
#include <string>
#include <vector>

#include "core/error.h"
#include "frontends/configuration/nearest_name.h"
#include "tools/commands.h"

namespace lodestone {

namespace {

/// A first word that is no subcommand: CLI11 would only say that one is missing.
void check_subcommand(const CLI::App& app, int argument_count, char** arguments) {
  if (argument_count < 2 || arguments[1][0] == '-') return;
  std::vector<std::string> names;
  for (const CLI::App* subcommand : app.get_subcommands([](const CLI::App*) { return true; })) {
    names.push_back(subcommand->get_name());
  }
  const std::string word = arguments[1];
  if (std::find(names.begin(), names.end(), word) != names.end()) return;
  throw InputError("there is no command '" + word + "'; did you mean '" + nearest_name(word, names) +
                   "'? (known: " + join_names(names) + ")");
}

}  // namespace

int run_program(int argument_count, char** arguments) {
  CLI::App app{
      "Lodestone reprocesses logs of a robot with LiDAR, IMU and magnetometers against prior maps.\n"
      "Start with:  lodestone simulate config/worlds/tunnel.yaml --out /tmp/tunnel"};
  app.name("lodestone");
  app.set_version_flag("--version", std::string("lodestone ") + LODESTONE_VERSION);
  app.require_subcommand(1);
  app.failure_message([](const CLI::App*, const CLI::Error& error) {
    return std::string("lodestone: ") + error.what() + " (see lodestone --help, or lodestone SUBCOMMAND --help)\n";
  });
  int code = exit_code::done;
  add_simulate_command(app, &code);
  add_convert_command(app, &code);
  add_check_command(app, &code);
  add_map_command(app, &code);
  add_calibrate_command(app, &code);
  add_run_command(app, &code);
  add_evaluate_command(app, &code);
  add_report_command(app, &code);
  add_reproduce_command(app, &code);
  add_ablate_command(app, &code);
  try {
    check_subcommand(app, argument_count, arguments);
    app.parse(argument_count, arguments);
  } catch (const CLI::ParseError& error) {
    // Help and version are no errors; everything else about the call is exit code 2, whatever CLI11 numbers it.
    return app.exit(error) == 0 ? exit_code::done : exit_code::input_error;
  } catch (const Interrupted&) {
    std::fprintf(stderr, "lodestone: interrupted\n");
    return exit_code::interrupted;
  } catch (const InputError& error) {
    std::fprintf(stderr, "lodestone: %s\n", error.what());
    return exit_code::input_error;
  } catch (const std::bad_alloc&) {
    std::fprintf(stderr, "lodestone: out of memory\n");
    return exit_code::input_error;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "lodestone: unexpected error: %s\n", error.what());
    return 1;
  }
  return code;
}

}  // namespace lodestone

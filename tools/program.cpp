#include "tools/program.h"

#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <csignal>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <new>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/nearest_name.h"
#include "tools/commands.h"
#include "tools/outputs_apart.h"

namespace lodestone {

namespace {

/// The command that the first words of a call name.
struct NamedCommand {
  const CLI::App* app = nullptr;
  std::string name = "lodestone";  ///< with the words that lead to it: "lodestone map truth"
  std::size_t words = 0;           ///< that name it
};

/// A word that is no subcommand: CLI11 would only say that one is missing.
[[noreturn]] void fail_unknown_command(const NamedCommand& parent, const std::string& word, const std::vector<std::string>& names) {
  throw InputError("there is no command '" + word + "'" + (parent.words > 0 ? " of " + parent.name : "") + suggestion(word, names) +
                   " (known: " + join_names(names) + ")");
}

/// Throws InputError where a word should be a subcommand and is none.
NamedCommand find_command(const CLI::App& app, const std::vector<std::string>& words) {
  NamedCommand command;
  command.app = &app;
  while (command.words < words.size() && words[command.words].front() != '-') {
    const std::string& word = words[command.words];
    std::vector<std::string> names;
    const CLI::App* named = nullptr;
    for (const CLI::App* subcommand : command.app->get_subcommands([](const CLI::App*) { return true; })) {
      names.push_back(subcommand->get_name());
      if (names.back() == word) named = subcommand;
    }
    if (names.empty()) break;
    if (named == nullptr) fail_unknown_command(command, word, names);
    command.app = named;
    command.name += " " + word;
    ++command.words;
  }
  return command;
}

/// An option that the command does not have. CLI11 would first complain of what is missing: often the one that was misspelt.
void check_options(const NamedCommand& command, const std::vector<std::string>& words) {
  std::vector<std::string> known;
  for (const CLI::Option* option : command.app->get_options()) {
    for (const std::string& name : option->get_lnames()) known.push_back("--" + name);
  }
  for (std::size_t i = command.words; i < words.size() && words[i] != "--"; ++i) {
    const std::string name = words[i].substr(0, words[i].find('='));
    if (!name.starts_with("--") || std::find(known.begin(), known.end(), name) != known.end()) continue;
    throw InputError("unknown option '" + name + "'" + suggestion(name, known) + " (see " + command.name + " --help)");
  }
}

/// A log of a night in a thousand parts takes a descriptor or two a part, and most shells begin with 1024.
void take_all_descriptors() {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0) return;
  limit.rlim_cur = limit.rlim_max;
  setrlimit(RLIMIT_NOFILE, &limit);
}

}  // namespace

int run_program(int argument_count, char** arguments) {
  std::signal(SIGXFSZ, SIG_IGN);  // a limit on the size of files is a full disk, and told as one
  take_all_descriptors();
  CLI::App app{
      "Lodestone reprocesses logs of a robot with LiDAR, IMU and magnetometers against prior maps.\n"
      "Start with:  lodestone simulate config/worlds/tunnel.yaml --out /tmp/tunnel"};
  app.name("lodestone");
  app.set_version_flag("--version", std::string("lodestone ") + LODESTONE_VERSION);
  app.require_subcommand(1);
  NamedCommand command;
  app.failure_message([&command](const CLI::App*, const CLI::Error& error) {
    return std::string("lodestone: ") + error.what() + " (see " + command.name + " --help)\n";
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
    std::vector<std::string> words(arguments + 1, arguments + argument_count);
    std::erase(words, std::string());
    command = find_command(app, words);
    check_options(command, words);
    check_outputs_apart(*command.app, command.name, {words.begin() + static_cast<std::ptrdiff_t>(command.words), words.end()});
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
  } catch (const std::filesystem::filesystem_error& error) {
    std::fprintf(stderr, "lodestone: %s: %s\n", error.path1().c_str(), error.code().message().c_str());
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

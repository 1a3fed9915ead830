#include "tools/program.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spdlog/spdlog.h>
#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <new>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/nearest_name.h"
#include "frontends/configuration/number_text.h"
#include "frontends/configuration/options.h"
#include "tools/commands.h"
#include "tools/messages.h"
#include "tools/progress.h"
#include "tools/run/resources.h"

namespace lodestone {

namespace {

/// The command named on the command line, as far as CLI11 has parsed.
struct NamedCommand {
  const CLI::App* app = nullptr;
  std::string name = "lodestone";  ///< with the words that lead to it: "lodestone map truth"
};

NamedCommand named_command(const CLI::App& app) {
  NamedCommand command;
  command.app = &app;
  while (!command.app->get_subcommands().empty()) {
    command.app = command.app->get_subcommands().back();
    command.name += " " + command.app->get_name();
  }
  return command;
}

bool is_whole_number(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  return type.starts_with("INT") || type.starts_with("UINT");
}

bool is_number_option(const CLI::Option& option) {
  return is_whole_number(option) || option.get_type_name().starts_with("FLOAT");
}

/// CLI11 reads an empty text as 0, so that a script with an unset variable would do something else, and -1 as 2^64 - 1.
void refuse_false_numbers(CLI::App& app) {
  for (CLI::Option* option : app.get_options()) {
    if (!is_number_option(*option)) continue;
    const std::string expected = is_whole_number(*option) ? "a whole number" : "a number";
    const bool from_0 = option->get_type_name().starts_with("UINT");
    option->check([expected, from_0](const std::string& text) {
      if (from_0 && text.starts_with('-')) return "expected a whole number from 0, found " + text;
      return text.empty() ? "expected " + expected + ", found ''" : std::string();
    });
  }
  for (CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) refuse_false_numbers(*command);
}

/// The value that an option expects: "a number", "3 numbers".
std::string expected_value(const CLI::Option& option) {
  const bool is_whole = is_whole_number(option);
  const bool is_number = is_number_option(option);
  if (const int count = option.get_expected_min(); count > 1) {
    return std::to_string(count) + (is_number ? " numbers" : " values");
  }
  return is_whole ? "a whole number" : is_number ? "a number" : "one value";
}

/// How often the option is on the command line, if each time it has as many values as it expects.
std::size_t times_given(const CLI::App& command, const CLI::Option& option) {
  const std::vector<CLI::Option*>& order = command.parse_order();
  const auto words = static_cast<std::size_t>(std::count(order.begin(), order.end(), &option));
  return std::min(words, option.results().size() / static_cast<std::size_t>(std::max(1, option.get_expected_min())));
}

/// One line about an option's value: what was expected and what was found.
std::string value_error(const CLI::App& command, const CLI::Error& error) {
  const std::string text = error.what();
  const auto options = command.get_options();
  const auto found = std::find_if(options.begin(), options.end(), [&text](const CLI::Option* option) {
    const std::string name = option->get_name();
    return text.starts_with(name + ": ") || text.starts_with("Could not convert: " + name + " = ");
  });
  if (found == options.end()) return text;
  const std::string prefix = (*found)->get_name() + ": ";
  const std::vector<std::string>& values = (*found)->results();
  if (error.get_name() == "ConversionError") {
    return fmt::format("{}expected {}, found '{}'", prefix, expected_value(**found), fmt::join(values, ","));
  }
  if (error.get_name() == "ArgumentMismatch") {
    if (const std::size_t times = times_given(command, **found); times > 1) {
      return fmt::format("{}given {} ({}); expected once", prefix,
                         times == 2 ? "twice" : std::to_string(times) + " times", join_names(values));
    }
    return prefix + "expected " + expected_value(**found) + ", found " +
           (values.empty() ? "none" : fmt::format("{}: {}", values.size(), join_names(values)));
  }
  const std::string between = " not in {";  // of CLI::IsMember
  const std::size_t names = text.rfind(between);
  if (names == std::string::npos || !text.ends_with('}')) return text;
  const std::size_t begin = names + between.size();
  return prefix + options_detail::unknown_name(text.substr(prefix.size(), names - prefix.size()),
                                               CLI::detail::split(text.substr(begin, text.size() - 1 - begin), ','));
}

/// One line about an error in the command line. CLI11 first reports missing options, which are often misspelt ones.
std::string call_error(const CLI::App& app, const CLI::Error& error) {
  const NamedCommand command = named_command(app);
  const std::string help = " (see " + command.name + " --help)";
  std::vector<std::string> options;
  for (const CLI::Option* option : command.app->get_options()) {
    for (const std::string& name : option->get_lnames()) options.push_back("--" + name);
  }
  std::vector<std::string> commands;
  const auto is_shown = [](const CLI::App* subcommand) { return !subcommand->get_group().empty(); };
  for (const CLI::App* subcommand : command.app->get_subcommands(is_shown)) {
    commands.push_back(subcommand->get_name());
  }
  for (const std::string& word : command.app->remaining()) {
    const std::string name = word.substr(0, word.find('='));
    if (name.starts_with("--")) return "unknown option '" + name + "'" + suggestion(name, options) + help;
    if (double number = 0.0; commands.empty() && parse_number(word, number)) {
      return "unexpected number '" + word + "'; put a pose in quotes" + help;
    }
    if (name.starts_with('-')) continue;
    if (commands.empty()) {
      std::string arguments;
      for (const CLI::Option* option : command.app->get_options()) {
        if (option->get_positional()) arguments += " " + option->get_name(true);
      }
      return "unexpected argument '" + word + "'; expected only" + (arguments.empty() ? " options" : arguments) + help;
    }
    return "there is no command '" + name + "'" + (command.app == &app ? "" : " of " + command.name) +
           suggestion(name, commands) + " (known: " + join_names(commands) + ")";
  }
  if (!commands.empty() && error.get_name() == "RequiredError") {
    return fmt::format("a command is missing: {}{}", join_names(commands), help);
  }
  return value_error(*command.app, error) + help;
}

/// A long log in a thousand parts requires one or two file descriptors per part; most shells limit a process to 1024.
void raise_descriptor_limit() {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0) return;
  limit.rlim_cur = limit.rlim_max;
  setrlimit(RLIMIT_NOFILE, &limit);
}

}  // namespace

int run_program(int argument_count, char** arguments, const std::string& revision) {
  const std::string version = fmt::format("lodestone {}, {}", LODESTONE_VERSION, revision);
  std::signal(SIGXFSZ, SIG_IGN);  // exceeding the limit on file sizes is reported like a full disk
  catch_interrupts();
  raise_descriptor_limit();
  CLI::App app{
      "Lodestone reprocesses logs of a robot with LiDAR, IMU and magnetometers against prior maps.\n"
      "Start with:  lodestone simulate tunnel --out /tmp/tunnel"};
  app.name("lodestone");
  app.set_version_flag("--version", version);
  app.require_subcommand(1);
  app.failure_message(
      [](const CLI::App* root, const CLI::Error& error) { return "lodestone: " + call_error(*root, error) + "\n"; });
  open_messages({});
  app.parse_complete_callback(
      [&]() { spdlog::debug("{}: {}", version, fmt::join(arguments + 1, arguments + argument_count, " ")); });
  int code = exit_code::done;
  add_simulate_command(app);
  add_convert_command(app);
  add_shift_command(app);
  add_init_command(app);
  add_check_command(app, &code);
  add_map_command(app);
  add_calibrate_command(app);
  add_run_command(app, &code);
  add_evaluate_command(app);
  add_report_command(app);
  add_export_command(app);
  add_reproduce_command(app, &code);
  add_ablate_command(app, &code);
  add_manual_command(app, version);
  refuse_false_numbers(app);
  try {
    app.parse(argument_count, arguments);
  } catch (const CLI::ParseError& error) {
    // Help and version are not errors. For all other errors of the call, the exit code is 2, not CLI11's.
    return app.exit(error) == 0 ? exit_code::done : exit_code::input_error;
  } catch (const Interrupted&) {
    spdlog::error("lodestone: interrupted");
    return exit_code::interrupted;
  } catch (const InputError& error) {
    spdlog::error("lodestone: {}", error.what());
    return exit_code::input_error;
  } catch (const std::filesystem::filesystem_error& error) {
    spdlog::error("lodestone: {}: {}", error.path1().string(), error.code().message());
    return exit_code::input_error;
  } catch (const std::bad_alloc&) {
    spdlog::error("lodestone: out of memory");
    return exit_code::input_error;
  } catch (const std::exception& error) {
    spdlog::error("lodestone: unexpected error: {}", error.what());
    return 1;
  }
  spdlog::debug("done with exit code {} after {:.1f} s of computing; peak memory {:.0f} MB", code,
                static_cast<double>(std::clock()) / CLOCKS_PER_SEC, peak_memory_mb());
  return code;
}

}  // namespace lodestone

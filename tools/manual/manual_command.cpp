#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "frontends/configuration/text_file.h"
#include "tools/commands.h"
#include "tools/writers/output_folder.h"

namespace lodestone {

namespace {

/// A command with the words that lead to it: "lodestone map cloud".
struct CommandOfManual {
  std::string name;
  const CLI::App* app;
  std::vector<const CLI::App*> subcommands;  ///< without hidden ones
};

void collect_commands(const CLI::App& app, const std::string& name, std::vector<CommandOfManual>& commands) {
  const auto is_shown = [](const CLI::App* subcommand) { return !subcommand->get_group().empty(); };
  commands.push_back({name, &app, app.get_subcommands(is_shown)});
  const std::vector<const CLI::App*> subcommands = commands.back().subcommands;
  for (const CLI::App* each : subcommands) collect_commands(*each, name + " " + each->get_name(), commands);
}

/// The program first, each command before its subcommands.
std::vector<CommandOfManual> commands_of(const CLI::App& program) {
  std::vector<CommandOfManual> commands;
  collect_commands(program, program.get_name(), commands);
  return commands;
}

/// Text for man(7): nothing in it is a request or an escape. Line breaks stay.
std::string man_text(const std::string& text) {
  std::string result;
  bool line_begins = true;
  for (const char character : text) {
    if (line_begins && (character == '.' || character == '\'')) result += "\\&";
    if (character == '\\') {
      result += "\\e";
    } else if (character == '-') {
      result += "\\-";
    } else {
      result += character;
    }
    line_begins = character == '\n';
  }
  return result;
}

/// The type of an option's value: "TEXT", and its permitted values: "TEXT:{none,batch}".
std::string value_of(const CLI::Option& option) {
  return option.get_type_size() == 0 ? "" : option.get_type_name();
}

std::vector<std::string> permitted_values(const CLI::Option& option) {
  const std::string type = value_of(option);
  const std::size_t begin = type.find('{');
  const std::size_t end = type.find('}', begin);
  if (begin == std::string::npos || end == std::string::npos) return {};
  return CLI::detail::split(type.substr(begin + 1, end - begin - 1), ',');
}

std::string man_entry(const CLI::Option& option) {
  std::string text = ".TP\n\\fB" + man_text(option.get_name(option.get_positional(), true)) + "\\fR";
  if (const std::string value = value_of(option); !value.empty()) text += " \\fI" + man_text(value) + "\\fR";
  if (option.get_required()) text += " (required)";
  if (!option.get_default_str().empty()) text += man_text(" (default: " + option.get_default_str() + ")");
  return text + "\n" + man_text(option.get_description()) + "\n";
}

std::string man_section(const CommandOfManual& command) {
  std::string text = fmt::format(".SS {}\n{}\n", man_text(command.name), man_text(command.app->get_description()));
  for (const CLI::Option* option : command.app->get_options()) {
    if (!option->get_group().empty()) text += man_entry(*option);
  }
  for (const CLI::App* each : command.subcommands) {
    text += fmt::format(".TP\n\\fB{}\\fR\n{}\n", man_text(each->get_name()), man_text(each->get_description()));
  }
  const std::string footer = command.app->get_footer();
  if (!footer.empty()) text += ".PP\n.nf\n" + man_text(footer) + "\n.fi\n";
  return text;
}

/// The manual page lodestone(1) of all commands and their options, as man(7) source. `version`: for its footer.
std::string man_page(const CLI::App& program, const std::string& version) {
  std::string text = fmt::format(
      ".TH LODESTONE 1 \"\" \"{}\" \"User Commands\"\n"
      ".SH NAME\nlodestone \\- localize logs of a robot in prior maps\n"
      ".SH SYNOPSIS\n.B lodestone\n\\fICOMMAND\\fR [\\fIOPTIONS\\fR]\n"
      ".SH COMMANDS\n",
      man_text(version));
  for (const CommandOfManual& command : commands_of(program)) text += man_section(command);
  return text +
         ".SH EXIT STATUS\n"
         ".TP\n0\nThe command is done.\n"
         ".TP\n2\nThe input or the call is wrong. One line on standard error gives the reason.\n"
         ".TP\n3\nAn estimator lost track. Its results are written and marked.\n"
         ".TP\n130\nThe command was interrupted. The results so far are written.\n"
         ".SH FILES\n.TP\n/usr/share/lodestone/config\nWorlds, platforms, experiments and ablations.\n";
}

/// Completion of commands, options and values for bash: a script for share/bash-completion/completions.
std::string bash_completion(const CLI::App& program) {
  std::string known;
  std::string words;
  std::string values;
  std::string groups;
  for (const CommandOfManual& command : commands_of(program)) {
    std::vector<std::string> completions;
    for (const CLI::App* each : command.subcommands) {
      completions.push_back(each->get_name());
      known += fmt::format("{}'{} {}'", known.empty() ? "" : " | ", command.name, each->get_name());
    }
    if (!command.subcommands.empty()) groups += fmt::format("{}'{}'", groups.empty() ? "" : " | ", command.name);
    for (const CLI::Option* option : command.app->get_options()) {
      for (const std::string& name : option->get_lnames()) {
        completions.push_back("--" + name);
        const std::vector<std::string> permitted = permitted_values(*option);
        if (permitted.empty()) continue;
        values += fmt::format("    '{} --{}') words='{}' ;;\n", command.name, name, fmt::join(permitted, " "));
      }
    }
    words += fmt::format("    '{}') words='{}' ;;\n", command.name, fmt::join(completions, " "));
  }
  return fmt::format(R"(# Completion of lodestone for bash. `lodestone manual` wrote this file.
_lodestone() {{
  local current=${{COMP_WORDS[COMP_CWORD]}} previous=${{COMP_WORDS[COMP_CWORD-1]}}
  local command=lodestone words='' list='' word
  for word in "${{COMP_WORDS[@]:1:COMP_CWORD-1}}"; do
    case "$command $word" in
      {}) command="$command $word" ;;
    esac
  done
  case "$command $previous" in
{}  esac
  if [[ -z $words ]]; then
    case "$command" in
      {}) ;;
      *) if [[ $current != -* ]]; then
           mapfile -t COMPREPLY < <(compgen -f -- "$current")
           compopt -o filenames 2>/dev/null
           return
         fi ;;
    esac
    case "$command" in
{}    esac
  fi
  # Of a list with commas, the last value is completed.
  [[ $current == *,* ]] && list="${{current%,*}},"
  mapfile -t COMPREPLY < <(compgen -P "$list" -W "$words" -- "${{current##*,}}")
}}
complete -F _lodestone lodestone
)",
                     known, values, groups, words);
}

}  // namespace

void add_manual_command(CLI::App& app, const std::string& version) {
  CLI::App* command = app.add_subcommand("manual", "Write the manual page and the completion for bash");
  command->group("");  // for packages: hidden in the help
  const auto out = std::make_shared<std::string>();
  command->add_option("--out", *out, "folder for lodestone.1 and lodestone.bash")->required();
  command->callback([&app, version, out] {
    const std::filesystem::path folder = made_folder(*out);
    write_text_file(folder / "lodestone.1", man_page(app, version));
    write_text_file(folder / "lodestone.bash", bash_completion(app));
  });
}

}  // namespace lodestone

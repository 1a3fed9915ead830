#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace lodestone {

/// The files that a command reads and writes, declared where its options are. After the command line has been parsed, a
/// result that would replace an input, or a part of one, ends the command before it begins: one line, exit code 2. Adds
/// the options of messages, which every command has: --verbose, --quiet, --log-file.
class CommandFiles {
 public:
  /// What a command writes if an output option has the value `out`, besides `out`.
  using Written = std::function<std::vector<std::filesystem::path>(const std::filesystem::path& out)>;

  explicit CommandFiles(CLI::App& command);

  /// The option's values name what is read: a file, a folder, or a name of neither. Returns the option.
  CLI::Option* input(CLI::Option* option);

  /// The option names what is written. Returns the option.
  CLI::Option* output(CLI::Option* option, Written besides = {});

  /// These files in the folder `out`.
  static Written within(std::vector<std::string> names);
  /// `out` with these endings instead of its own.
  static Written with_endings(std::vector<std::string> endings);

 private:
  struct Declared;
  std::shared_ptr<Declared> declared_;  ///< shared with the command, which outlives this
};

}  // namespace lodestone

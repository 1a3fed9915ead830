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

/// The files that a command reads and writes, declared together with its options. After parsing, the command ends with
/// one line and exit code 2 if a result would replace an input, or a part of one. Adds the options for messages that
/// every command has: --verbose, --quiet, --log-file.
class CommandFiles {
 public:
  /// Further files that a command writes if an output option has the value `out`.
  using Written = std::function<std::vector<std::filesystem::path>(const std::filesystem::path& out)>;

  explicit CommandFiles(CLI::App& command);

  /// Declares that the option's values may name files or folders to read. Returns the option.
  CLI::Option* input(CLI::Option* option);

  /// Declares that the option names a file or folder to write. Returns the option.
  CLI::Option* output(CLI::Option* option, Written besides = {});

  /// These files in the folder `out`.
  static Written within(std::vector<std::string> names);
  /// `out` with these endings instead of its own.
  static Written with_endings(std::vector<std::string> endings);

 private:
  struct Declared;
  std::shared_ptr<Declared> declared_;  ///< shared with the command, which outlives this
};

/// Throws InputError if two of the logs are the same file or folder. `remedy`: end of the message.
void check_different(const std::vector<std::string>& logs, const std::string& remedy);

/// Refuses a number of threads below one. Returns the option.
CLI::Option* at_least_one(CLI::Option* option);

}  // namespace lodestone

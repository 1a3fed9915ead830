#include "tools/command_files.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <utility>

#include "core/error.h"
#include "frontends/configuration/file_kind.h"
#include "frontends/maps/magnetic_map_file.h"
#include "tools/messages.h"
#include "tools/writers/output_folder.h"

namespace lodestone {
namespace {

namespace fs = std::filesystem;

/// A file that the command reads, and its name in messages.
struct ReadFile {
  fs::path path;
  std::string label;
};

/// "--out field.yaml", or the value alone for a positional argument.
std::string label_of(const CLI::Option& option, const std::string& value) {
  return option.get_positional() ? value : option.get_name() + " " + value;
}

/// A file and the files that it refers to.
std::vector<ReadFile> with_named_files(const std::string& file, const std::string& label) {
  std::vector<ReadFile> files{{file, label}};
  std::error_code ignored;
  if (!fs::is_regular_file(file, ignored) || seeming_kind_of_file(file) != SeemingKind::magnetic_map) return files;
  try {
    const std::string image = image_of_magnetic_map(file);
    files.push_back({image, image + ", the image of " + label});
  } catch (const InputError&) {
    // The map's reader reports what is wrong with the map.
  }
  return files;
}

/// Whether the file is part of the log or map `given`, which is a folder, or the list of a folder's files.
bool is_part_of(const fs::path& file, const fs::path& given) {
  std::error_code ignored;
  const fs::path folder = given.filename() == "metadata.yaml" ? fs::absolute(given, ignored).parent_path() : given;
  if (!fs::is_directory(folder, ignored) || path_below(file.string(), folder.string()).empty()) return false;
  const SeemingKind kind = seeming_kind_of_file(file.string());
  return kind == SeemingKind::log || kind == SeemingKind::point_cloud || file.extension() == ".csv";
}

}  // namespace

struct CommandFiles::Declared {
  MessageOptions messages;
  std::vector<const CLI::Option*> inputs;
  std::vector<std::pair<const CLI::Option*, Written>> outputs;

  std::vector<ReadFile> read_files() const {
    std::vector<ReadFile> files;
    for (const CLI::Option* option : inputs) {
      for (const std::string& value : option->results()) {
        for (ReadFile& file : with_named_files(value, label_of(*option, value))) files.push_back(std::move(file));
      }
    }
    return files;
  }

  /// Throws InputError if an output file would replace an input file, or a part of one.
  void check() const {
    std::error_code ignored;
    for (const auto& [option, besides] : outputs) {
      for (const std::string& out : option->results()) {
        std::vector<fs::path> written{out};
        if (besides) {
          for (const fs::path& path : besides(out)) written.push_back(path);
        }
        for (const fs::path& path : written) {
          if (!fs::is_regular_file(path, ignored)) continue;
          for (const ReadFile& read : read_files()) {
            const bool same = fs::equivalent(path, read.path, ignored);
            if (!same && !is_part_of(path, read.path)) continue;
            throw InputError(fmt::format("{}: {}{}{}, which the results would overwrite; choose another name for them",
                                         label_of(*option, out),
                                         path == fs::path(out) ? "" : path.string() + ", which is written too, ",
                                         same ? "is " : "is a part of ", read.label));
          }
        }
      }
    }
  }
};

CommandFiles::CommandFiles(CLI::App& command) : declared_(std::make_shared<Declared>()) {
  const char* group = "Messages";
  CLI::Option* quiet =
      command.add_flag("--quiet", declared_->messages.quiet, "no progress, only errors on stderr")->group(group);
  command.add_flag("--verbose", declared_->messages.verbose, "details on stderr")->group(group)->excludes(quiet);
  output(command.add_option("--log-file", declared_->messages.log_file,
                            "write all messages to this file too, with time and level"))
      ->group(group);
  command.parse_complete_callback([declared = declared_]() {
    declared->check();
    open_messages(declared->messages);
  });
}

CLI::Option* CommandFiles::input(CLI::Option* option) {
  declared_->inputs.push_back(option);
  return option;
}

CLI::Option* CommandFiles::output(CLI::Option* option, Written besides) {
  declared_->outputs.emplace_back(option, std::move(besides));
  return option;
}

CommandFiles::Written CommandFiles::within(std::vector<std::string> names) {
  return [names = std::move(names)](const fs::path& out) {
    std::vector<fs::path> files;
    for (const std::string& name : names) files.push_back(out / name);
    return files;
  };
}

CommandFiles::Written CommandFiles::with_endings(std::vector<std::string> endings) {
  return [endings = std::move(endings)](const fs::path& out) {
    std::vector<fs::path> files;
    for (const std::string& ending : endings) files.push_back(fs::path(out).replace_extension(ending));
    return files;
  };
}

void check_different(const std::vector<std::string>& logs, const std::string& remedy) {
  for (std::size_t i = 0; i < logs.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      std::error_code ignored;
      if (logs[i] != logs[j] && !fs::equivalent(logs[i], logs[j], ignored)) continue;
      throw InputError(logs[i] + ": the log is given twice; " + remedy);
    }
  }
}

CLI::Option* at_least_one(CLI::Option* option) {
  return option->check(
      [](const std::string& text) {
        int number = 0;
        const bool is_number = CLI::detail::lexical_cast(text, number);
        return is_number && number >= 1 ? std::string() : fmt::format("expected at least 1, found {}", text);
      },
      "");
}

}  // namespace lodestone

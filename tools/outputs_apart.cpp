#include "tools/outputs_apart.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <map>

#include "core/error.h"
#include "frontends/configuration/file_kind.h"
#include "frontends/maps/magnetic_map_file.h"
#include "tools/writers/path_below.h"

namespace lodestone {
namespace {

namespace fs = std::filesystem;

/// A word of a call that may name a file, with the option that it belongs to, where it belongs to one.
struct GivenWord {
  std::string option, value;

  std::string label() const { return option.empty() ? value : option + " " + value; }
};

/// A file of the call, and how it is called in a message.
struct CallFile {
  fs::path path;
  std::string label;
};

std::vector<GivenWord> given_words(const CLI::App& command, const std::vector<std::string>& words) {
  std::vector<GivenWord> given;
  std::string awaited;  // the option whose value comes next
  for (const std::string& word : words) {
    if (!word.starts_with("--")) {
      given.push_back({awaited, word});
      awaited.clear();
      continue;
    }
    const std::size_t assigned = word.find('=');
    awaited = word.substr(0, assigned);
    const CLI::Option* option = command.get_option_no_throw(awaited);
    if (assigned != std::string::npos) given.push_back({awaited, word.substr(assigned + 1)});
    if (assigned != std::string::npos || option == nullptr || option->get_items_expected_max() == 0) awaited.clear();
  }
  return given;
}

/// What the command writes where --out is `out`: names that only its own code knows besides.
std::vector<fs::path> written_files(const std::string& command, const fs::path& out) {
  static const std::map<std::string, std::vector<std::string>> in_folder{
      {"lodestone simulate", {"platform.yaml", "log.bag", "truth.tum", "cloud.pcd", "survey.bag", "survey.tum"}},
      {"lodestone map diff",
       {"picture.png", "picture.pdf", "picture.svg", "difference.yaml", "difference.tif", "places.csv", "diff.json"}}};
  static const std::map<std::string, std::vector<std::string>> with_endings{{"lodestone map magnetic", {".tif", ".png"}},
                                                                            {"lodestone map import", {".tif", ".png"}},
                                                                            {"lodestone map truth", {".tif"}}};
  std::vector<fs::path> files{out};
  if (const auto names = in_folder.find(command); names != in_folder.end()) {
    for (const std::string& name : names->second) files.push_back(out / name);
  }
  if (const auto endings = with_endings.find(command); endings != with_endings.end()) {
    for (const std::string& ending : endings->second) files.push_back(fs::path(out).replace_extension(ending));
  }
  if (command == "lodestone calibrate magnetometers") files.push_back(fs::path(out).replace_filename("calibration.json"));
  return files;
}

/// What is read where a word names a file: that, and what it names itself.
std::vector<CallFile> read_files(const GivenWord& word) {
  std::vector<CallFile> files{{word.value, word.label()}};
  std::error_code ignored;
  if (!fs::is_regular_file(word.value, ignored) || seeming_kind_of_file(word.value) != SeemingKind::magnetic_map) return files;
  try {
    const std::string image = image_of_magnetic_map(word.value);
    files.push_back({image, image + ", the image of " + word.label()});
  } catch (const InputError&) {
    // Its reader will say what is wrong with it.
  }
  return files;
}

/// Whether the file is a part of what `given`, a folder or what lists its files, seems to be: of a log, or of a map.
bool is_part_of(const fs::path& file, const fs::path& given) {
  std::error_code ignored;
  const fs::path folder = given.filename() == "metadata.yaml" ? fs::absolute(given, ignored).parent_path() : given;
  if (!fs::is_directory(folder, ignored) || path_below(file.string(), folder.string()).empty()) return false;
  const SeemingKind kind = seeming_kind_of_file(file.string());
  return kind == SeemingKind::log || kind == SeemingKind::point_cloud || file.extension() == ".csv";
}

}  // namespace

void check_outputs_apart(const CLI::App& command, const std::string& name, const std::vector<std::string>& words) {
  std::error_code ignored;
  const std::vector<GivenWord> given = given_words(command, words);
  for (const GivenWord& out : given) {
    if (out.option != "--out" && out.option != "--errors") continue;
    for (const fs::path& written : written_files(name, out.value)) {
      if (!fs::is_regular_file(written, ignored)) continue;
      const std::string which = written == fs::path(out.value) ? "" : written.string() + ", which is written too, ";
      for (const GivenWord& other : given) {
        if (&other == &out) continue;
        for (const CallFile& read : read_files(other)) {
          const bool same = fs::equivalent(written, read.path, ignored);
          if (!same && !is_part_of(written, read.path)) continue;
          throw InputError(fmt::format("{}: {}{}{}, which the results would overwrite; choose another name for them", out.label(), which,
                                       same ? "is " : "is a part of ", read.label));
        }
      }
    }
  }
}

}  // namespace lodestone

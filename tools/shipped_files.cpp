#include "tools/shipped_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <vector>

#include "core/error.h"
#include "core/nearest_name.h"

namespace lodestone {

namespace fs = std::filesystem;

namespace {

/// Of the installation that the running program belongs to.
fs::path share_folder() {
  std::error_code ignored;
  const fs::path program = fs::read_symlink("/proc/self/exe", ignored);
  return program.parent_path().parent_path() / "share" / "lodestone";
}

}  // namespace

std::string find_shipped(const std::string& folder, const std::string& what, const std::string& name) {
  if (name.find('/') != std::string::npos || fs::path(name).extension() == ".yaml") return name;
  const fs::path tail = fs::path("config") / folder / (name + ".yaml");
  std::error_code ignored;
  const std::vector<fs::path> places{fs::path(), fs::path(LODESTONE_SOURCE_FOLDER), share_folder()};
  std::vector<std::string> known;
  for (const fs::path& place : places) {
    if (fs::exists(place / tail, ignored)) return (place / tail).string();
    for (const auto& entry : fs::directory_iterator((place / tail).parent_path(), ignored)) {
      if (entry.path().extension() == ".yaml") known.push_back(entry.path().stem().string());
    }
  }
  std::sort(known.begin(), known.end());
  known.erase(std::unique(known.begin(), known.end()), known.end());
  throw InputError(fmt::format("there is no {} '{}' in config/{}{}; a path to a YAML file works too", what, name,
                               folder, known.empty() ? "" : fmt::format(" (known: {})", join_names(known))));
}

std::string find_fleet_file(const std::string& name) {
  const fs::path source = fs::path(LODESTONE_SOURCE_FOLDER) / "tools" / "fleet" / name;
  const fs::path installed = share_folder() / "fleet" / name;
  for (const fs::path& path : {source, installed}) {
    if (fs::exists(path)) return path.string();
  }
  throw InputError(fmt::format("{}: not found in {} or {}; install the package lodestone anew", name,
                               source.parent_path().string(), installed.parent_path().string()));
}

}  // namespace lodestone

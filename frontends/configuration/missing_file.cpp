#include "frontends/configuration/missing_file.h"

#include <algorithm>
#include <filesystem>
#include <vector>

#include "core/nearest_name.h"

namespace lodestone {

namespace fs = std::filesystem;

namespace {

/// A folder with more entries, such as one of single images, is not searched for a similar name.
constexpr std::size_t kMostNames = 1000;

std::vector<std::string> names_in(const fs::path& folder) {
  std::vector<std::string> names;
  std::error_code code;
  for (fs::directory_iterator entry(folder, code), end; !code && entry != end; entry.increment(code)) {
    if (names.size() == kMostNames) return {};
    names.push_back(entry->path().filename().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace

InputError missing_file(const std::string& path, const std::string& what) {
  std::error_code code;
  const fs::path name = fs::path(path).filename();
  fs::path folder = fs::path(path).parent_path();
  if (folder.empty()) folder = ".";
  const std::string text = path + ": there is no such " + what;
  if (!fs::is_directory(folder, code)) return InputError(text + "; there is no folder '" + folder.string() + "'");
  return InputError(text + suggestion(name.string(), names_in(folder)));
}

}  // namespace lodestone

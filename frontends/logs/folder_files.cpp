#include "frontends/logs/folder_files.h"

#include <algorithm>
#include <set>
#include <system_error>

namespace lodestone {

std::vector<std::filesystem::path> files_below(const std::filesystem::path& folder) {
  namespace fs = std::filesystem;
  std::vector<fs::path> files;
  std::set<fs::path> links, walked;  // walked: resolved folders
  const auto walk = [&](const fs::path& start, fs::directory_options options) {
    if (!walked.insert(fs::canonical(start)).second) return;
    std::error_code broken;  // a broken or circular link is not a file
    for (fs::recursive_directory_iterator entry(start, options), end; entry != end; ++entry) {
      if (entry->is_regular_file(broken)) {
        files.push_back(entry->path());
      } else if (entry->is_directory(broken) && entry->is_symlink()) {
        links.insert(entry->path());
      } else if (entry->is_directory(broken) && !walked.insert(fs::canonical(entry->path())).second) {
        entry.disable_recursion_pending();
      }
    }
  };
  walk(folder, fs::directory_options::none);
  while (!links.empty()) walk(links.extract(links.begin()).value(), fs::directory_options::skip_permission_denied);
  std::sort(files.begin(), files.end());
  return files;
}

}  // namespace lodestone

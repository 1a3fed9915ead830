#include "tools/writers/output_folder.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <system_error>
#include <vector>

#include "core/error.h"

namespace lodestone {

void check_folder(const std::filesystem::path& folder) {
  std::error_code ignored;
  std::filesystem::path there = std::filesystem::absolute(folder, ignored);
  while (!std::filesystem::exists(there, ignored) && there != there.parent_path()) there = there.parent_path();
  if (!std::filesystem::is_directory(there, ignored)) {
    throw InputError(fmt::format("{}: cannot create the folder: {} is not a folder; choose another --out",
                                 folder.string(), there.string()));
  }
  if (access(there.c_str(), W_OK | X_OK) != 0) {
    throw InputError(fmt::format("{}: cannot be written: {}: {}; choose another --out", folder.string(), there.string(),
                                 std::strerror(errno)));
  }
}

std::filesystem::path made_folder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) {
    throw InputError(
        fmt::format("{}: cannot create the folder: {}; choose another path", folder.string(), error.message()));
  }
  return folder;
}

void make_folder_of(const std::filesystem::path& file) {
  if (file.has_parent_path()) made_folder(file.parent_path());
}

std::filesystem::path emptied_folder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::remove_all(folder, error);
  if (error)
    throw InputError(fmt::format("{}: cannot be emptied: {}; choose another --out", folder.string(), error.message()));
  return made_folder(folder);
}

void refuse_folder(const std::string& out, const std::string& option) {
  std::error_code ignored;
  if (!std::filesystem::is_directory(out, ignored)) return;
  throw InputError(fmt::format("{} {}: is a folder; expected the name of a file", option, out));
}

void refuse_to_replace(const std::string& out, bool force, std::initializer_list<const char*> endings,
                       const std::string& option) {
  refuse_folder(out, option);
  if (force) return;
  std::vector<std::filesystem::path> files{out};
  for (const char* ending : endings) files.push_back(std::filesystem::path(out).replace_extension(ending));
  for (const std::filesystem::path& file : files) {
    std::error_code ignored;
    if (!std::filesystem::exists(file, ignored)) continue;
    throw InputError(fmt::format("{} {}: the file exists; choose another name, or set --force to replace the file",
                                 option, file.string()));
  }
}

std::filesystem::path path_below(const std::string& path, const std::string& folder) {
  namespace fs = std::filesystem;
  const fs::path relative = fs::weakly_canonical(path).lexically_relative(fs::weakly_canonical(folder));
  return relative.empty() || *relative.begin() == ".." ? fs::path() : relative;
}

std::filesystem::path output_with_ending(const std::string& out, const std::string& ending) {
  const std::filesystem::path path(out);
  if (path.extension() != ending) throw InputError(out + ": expected a name ending in " + ending + " for --out");
  make_folder_of(path);
  return path;
}

}  // namespace lodestone

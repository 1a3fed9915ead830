#include "frontends/logs/temporary_file.h"

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <limits>
#include <string_view>

#include "core/error.h"

namespace lodestone {
namespace {

constexpr std::string_view temporary_prefix = "lodestone-";

std::filesystem::path temporary_folder() {
  std::error_code error;
  const std::filesystem::path folder = std::filesystem::temp_directory_path(error);
  if (error)
    throw InputError("TMPDIR: is not a folder (" + error.message() +
                     "); set it to a folder with space for an unpacked log");
  return folder;
}

/// The process id in the name of a TemporaryFile: lodestone-PROCESS-XXXXXX. Empty for any other name, which belongs to
/// another program.
std::string_view owner_of(std::string_view name) {
  constexpr std::string_view digits = "0123456789";
  constexpr std::string_view letters = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz";
  if (!name.starts_with(temporary_prefix)) return {};
  name.remove_prefix(temporary_prefix.size());
  const std::size_t dash = std::min(name.find_first_not_of(digits), name.size());
  const std::string_view process = name.substr(0, dash), rest = name.substr(dash);
  if (rest.size() != 7 || rest.front() != '-' || rest.find_first_not_of(letters, 1) != std::string_view::npos)
    return {};
  return process;
}

/// Removes files older than a day. Younger files may belong to a process of another container.
void remove_leftovers(const std::filesystem::path& folder) {
  constexpr std::time_t day = 24 * 60 * 60;
  const std::time_t now = std::time(nullptr);
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator(folder, ignored)) {
    const std::string name = entry.path().filename().string();
    const std::string_view process = owner_of(name);
    struct stat status {};
    if (process.empty() || std::filesystem::exists("/proc/" + std::string(process), ignored)) continue;
    if (::lstat(entry.path().c_str(), &status) != 0 || !S_ISREG(status.st_mode) || status.st_uid != ::geteuid())
      continue;
    if (status.st_mtime > now - day) continue;
    std::filesystem::remove(entry.path(), ignored);
  }
}

}  // namespace

TemporaryFile::TemporaryFile() {
  const std::filesystem::path folder = temporary_folder();
  remove_leftovers(folder);
  path_ = (folder / fmt::format("{}{}-XXXXXX", temporary_prefix, ::getpid())).string();
  const int file = mkstemp(path_.data());
  if (file < 0) {
    const std::string why = std::strerror(errno);
    throw InputError(fmt::format("{}: cannot be written ({}); set TMPDIR to another folder", folder.string(), why));
  }
  ::close(file);
}

TemporaryFile::~TemporaryFile() {
  std::error_code ignored;
  std::filesystem::remove(path_, ignored);
}

std::uint64_t TemporaryFile::room() const {
  std::error_code error;
  const std::filesystem::space_info space = std::filesystem::space(std::filesystem::path(path_).parent_path(), error);
  if (error) return std::numeric_limits<std::uint64_t>::max();  // a full disk is detected when writing
  return space.available - space.available / 20;
}

}  // namespace lodestone

#include "frontends/configuration/text_file.h"

#include <cerrno>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "core/error.h"
#include "frontends/configuration/missing_file.h"
#include "frontends/configuration/output_file.h"

namespace lodestone {

namespace {

/// No text file of this program is larger.
constexpr std::uintmax_t kMostTextBytes = std::uintmax_t{1} << 32;

/// A pipe passed by the shell, as in `--truth <(zcat truth.tum.gz)`, has an end; a named pipe may block forever.
bool is_handed_over(const std::string& path) {
  return path.rfind("/dev/fd/", 0) == 0 || path.rfind("/proc/self/fd/", 0) == 0 || path == "/dev/stdin";
}

}  // namespace

std::string read_text_file(const std::string& path) {
  std::error_code code;
  if (!std::filesystem::exists(path, code)) throw missing_file(path);
  if (std::filesystem::is_directory(path, code)) throw InputError(path + ": expected a file, found a folder");
  const bool is_file = std::filesystem::is_regular_file(path, code);
  if (!is_file && !is_handed_over(path))
    throw InputError(path + ": expected a file, found a pipe, a device or a socket");
  const std::uintmax_t bytes = is_file ? std::filesystem::file_size(path, code) : 0;
  if (!code && bytes > kMostTextBytes) {
    throw InputError(path + ": has " + std::to_string(bytes) + " bytes; expected a text of at most " +
                     std::to_string(kMostTextBytes));
  }
  std::ifstream stream(path, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  if (!stream) throw InputError(path + ": cannot be read (" + std::strerror(errno) + ")");
  return text;
}

void write_text_file(const std::filesystem::path& path, const std::string& text) {
  OutputFile file(path);
  file.write(text);
  file.commit();
}

}  // namespace lodestone

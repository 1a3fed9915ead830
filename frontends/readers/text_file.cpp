#include "frontends/readers/text_file.h"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "core/error.h"

namespace lodestone {

std::string read_text_file(const std::string& path) {
  std::error_code code;
  if (!std::filesystem::exists(path, code)) throw InputError(path + ": there is no such file");
  if (std::filesystem::is_directory(path, code)) throw InputError(path + ": expected a file, found a folder");
  std::ifstream stream(path, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  if (!stream) throw InputError(path + ": cannot be read (" + std::strerror(errno) + ")");
  return text;
}

void write_text_file(const std::string& path, const std::string& text) {
  const std::string aside = path + ".part";
  {
    std::ofstream stream(aside, std::ios::binary | std::ios::trunc);
    stream << text;
    stream.close();
    if (!stream) {
      const std::string reason = std::strerror(errno);
      std::remove(aside.c_str());
      throw InputError(path + ": cannot be written (" + reason + ")");
    }
  }
  std::error_code code;
  std::filesystem::rename(aside, path, code);
  if (code) {
    std::remove(aside.c_str());
    throw InputError(path + ": cannot be written (" + code.message() + ")");
  }
}

}  // namespace lodestone

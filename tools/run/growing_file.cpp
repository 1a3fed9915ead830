#include "tools/run/growing_file.h"

#include <fmt/format.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <system_error>

#include "core/error.h"

namespace lodestone {

std::uint64_t hash_of(std::string_view bytes, std::uint64_t hash) {
  for (const char byte : bytes) {
    hash ^= static_cast<unsigned char>(byte);
    hash *= 1099511628211ULL;
  }
  return hash;
}

void GrowingFile::append(std::string_view bytes) {
  std::ofstream file(path_, std::ios::binary | (extent_.bytes == 0 ? std::ios::trunc : std::ios::app));
  file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  file.close();
  if (!file) throw InputError(fmt::format("{}: not written whole: {}", path_.string(), std::strerror(errno)));
  extent_.bytes += bytes.size();
  extent_.hash = hash_of(bytes, extent_.hash);
}

std::string GrowingFile::read(const FileExtent& extent) {
  std::string content(extent.bytes, '\0');
  std::ifstream file(path_, std::ios::binary);
  file.read(content.data(), static_cast<std::streamsize>(content.size()));
  if (static_cast<std::uint64_t>(file.gcount()) != extent.bytes || hash_of(content) != extent.hash) {
    throw InputError(fmt::format("{}: damaged: expected {} bytes as they were written, found {}; run without --resume to begin anew",
                                 path_.string(), extent.bytes, file.is_open() ? "others or fewer" : "no such file"));
  }
  file.close();
  std::error_code error;
  std::filesystem::resize_file(path_, extent.bytes, error);
  if (error) throw InputError(fmt::format("{}: cannot be written: {}", path_.string(), error.message()));
  extent_ = extent;
  return content;
}

}  // namespace lodestone

#include "frontends/maps/spool_file.h"

#include <fcntl.h>
#include <stdlib.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

#include "core/error.h"

namespace lodestone {

SpoolFile::SpoolFile(const std::string& folder) : folder_(folder) {
  std::error_code code;
  std::filesystem::create_directories(folder, code);  // if this fails, the next call reports it
  std::string name = folder + "/tiles.XXXXXX";
  descriptor_ = mkostemp(name.data(), O_CLOEXEC);
  if (descriptor_ < 0) fail("cannot create a temporary file");
  unlink(name.c_str());
}

SpoolFile::~SpoolFile() {
  close(descriptor_);
}

std::int64_t SpoolFile::append(const void* data, std::size_t bytes) {
  const std::int64_t begin = size_;
  const char* next = static_cast<const char*>(data);
  while (bytes > 0) {
    const ssize_t written = pwrite(descriptor_, next, bytes, size_);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) fail("cannot write the map's tiles");
    next += written;
    size_ += written;
    bytes -= static_cast<std::size_t>(written);
  }
  return begin;
}

void SpoolFile::read(std::int64_t offset, void* data, std::size_t bytes) const {
  char* next = static_cast<char*>(data);
  while (bytes > 0) {
    const ssize_t taken = pread(descriptor_, next, bytes, offset);
    if (taken < 0 && errno == EINTR) continue;
    if (taken <= 0) fail("cannot read the map's tiles");
    next += taken;
    offset += taken;
    bytes -= static_cast<std::size_t>(taken);
  }
}

void SpoolFile::fail(const char* what) const {
  throw InputError(
      folder_ + ": " + what + " (" + std::strerror(errno) +
      "); choose a folder with free disk space, or increase lidar.map.tile_above_points to keep the map in memory");
}

}  // namespace lodestone

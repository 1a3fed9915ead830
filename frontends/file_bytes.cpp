#include "frontends/file_bytes.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "core/error.h"
#include "frontends/configuration/missing_file.h"

namespace lodestone {

namespace {

/// Throws the error of errno.
[[noreturn]] void refuse_to_open(const std::string& path) {
  const bool too_many = errno == EMFILE || errno == ENFILE;
  throw InputError(path + ": cannot be opened for reading; " +
                   (too_many ? "too many files are open: raise the limit (ulimit -n)" : "check its permissions"));
}

}  // namespace

FileBytes::FileBytes(std::string path) : path_(std::move(path)) {
  struct stat status {};
  if (::stat(path_.c_str(), &status) != 0) throw missing_file(path_);
  if (!S_ISREG(status.st_mode)) throw InputError(path_ + ": expected a log, but this is not a regular file");
  descriptor_ = ::open(path_.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor_ < 0) refuse_to_open(path_);
  size_ = static_cast<std::uint64_t>(status.st_size);
}

FileBytes::~FileBytes() {
  ::close(descriptor_);
}

void FileBytes::read(std::uint64_t offset, std::size_t count, std::vector<std::uint8_t>& bytes) const {
  if (offset > size_ || count > size_ - offset) {
    throw InputError(fmt::format("{}: the file is truncated: bytes {} to {} are required, the size is {}", path_,
                                 offset, offset + count, size_));
  }
  bytes.resize(count);
  read(offset, bytes);
}

void FileBytes::read(std::uint64_t offset, std::span<std::uint8_t> bytes) const {
  for (std::size_t done = 0; done < bytes.size();) {
    const ssize_t count =
        ::pread(descriptor_, bytes.data() + done, bytes.size() - done, static_cast<off_t>(offset + done));
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) {
      throw InputError(fmt::format("{}: cannot be read at byte {}: {}", path_, offset + done,
                                   count == 0 ? "the file ends there" : std::strerror(errno)));
    }
    done += static_cast<std::size_t>(count);
  }
}

}  // namespace lodestone

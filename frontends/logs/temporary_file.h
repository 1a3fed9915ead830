#pragma once

#include <cstdint>
#include <string>

namespace lodestone {

/// A file in the temporary folder (TMPDIR), deleted by the destructor. The constructor also deletes files of killed
/// processes that are older than a day.
class TemporaryFile {
 public:
  /// Throws InputError if there is no such folder, or it cannot be written.
  TemporaryFile();
  ~TemporaryFile();
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  const std::string& path() const { return path_; }

  /// Bytes that may be written: the free space of the disk, minus 5 % for other processes.
  std::uint64_t room() const;

 private:
  std::string path_;
};

}  // namespace lodestone

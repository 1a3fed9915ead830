#pragma once

#include <cstdint>
#include <string>

namespace lodestone {

/// A file in the folder of temporary files (TMPDIR) that is gone when this is. What a killed process has left there, a
/// day old, goes with the next one that is made.
class TemporaryFile {
 public:
  /// Throws InputError where there is no such folder, or it cannot be written.
  TemporaryFile();
  ~TemporaryFile();
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  const std::string& path() const { return path_; }

  /// How many bytes may be written to it: what its disk has free, less a twentieth for all others.
  std::uint64_t room() const;

 private:
  std::string path_;
};

}  // namespace lodestone

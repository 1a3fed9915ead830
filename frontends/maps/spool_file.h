#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace lodestone {

/// A temporary file for data larger than memory. The file has no name in its folder, so that nothing remains after any
/// end of the program.
class SpoolFile {
 public:
  /// Creates `folder` if it does not exist. Throws InputError if the file cannot be created.
  explicit SpoolFile(const std::string& folder);
  ~SpoolFile();
  SpoolFile(const SpoolFile&) = delete;
  SpoolFile& operator=(const SpoolFile&) = delete;

  /// Writes at the end and returns the offset. Throws InputError if the disk is full or fails.
  std::int64_t append(const void* data, std::size_t bytes);

  /// Reads appended data. Throws InputError if the disk fails.
  void read(std::int64_t offset, void* data, std::size_t bytes) const;

  std::int64_t size() const { return size_; }

 private:
  [[noreturn]] void fail(const char* what) const;

  std::string folder_;
  int descriptor_ = -1;
  std::int64_t size_ = 0;
};

}  // namespace lodestone

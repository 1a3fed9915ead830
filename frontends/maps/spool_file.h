#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace lodestone {

/// A temporary file for what does not fit into memory. It has no name in its folder: whatever ends the program, nothing
/// of it stays behind.
class SpoolFile {
 public:
  /// Makes `folder` where there is none. Throws InputError where it does not take a file.
  explicit SpoolFile(const std::string& folder);
  ~SpoolFile();
  SpoolFile(const SpoolFile&) = delete;
  SpoolFile& operator=(const SpoolFile&) = delete;

  /// Writes at the end; returns where. Throws InputError where the disk is full or fails.
  std::int64_t append(const void* data, std::size_t bytes);

  /// Reads what was appended. Throws InputError where the disk fails.
  void read(std::int64_t offset, void* data, std::size_t bytes) const;

  std::int64_t size() const { return size_; }

 private:
  [[noreturn]] void fail(const char* what) const;

  std::string folder_;
  int descriptor_ = -1;
  std::int64_t size_ = 0;
};

}  // namespace lodestone

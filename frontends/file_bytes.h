#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace lodestone {

/// A file with random access.
class FileBytes {
 public:
  /// Throws InputError if there is no such regular file, or it cannot be opened.
  explicit FileBytes(std::string path);
  ~FileBytes();
  FileBytes(const FileBytes&) = delete;
  FileBytes& operator=(const FileBytes&) = delete;

  const std::string& path() const { return path_; }
  std::uint64_t size() const { return size_; }

  /// Reads `count` bytes from `offset` into `bytes`. Throws InputError if the file ends before, or if reading fails.
  void read(std::uint64_t offset, std::size_t count, std::vector<std::uint8_t>& bytes) const;

  /// The same into existing memory.
  void read(std::uint64_t offset, std::span<std::uint8_t> bytes) const;

 private:
  std::string path_;
  std::uint64_t size_ = 0;
  int descriptor_ = -1;
};

/// Reads a little-endian number.
template <class Number>
Number little_endian(const std::uint8_t* bytes) {
  Number value = 0;
  for (std::size_t i = sizeof(Number); i-- > 0;) value = static_cast<Number>((value << 8) | bytes[i]);
  return value;
}
template <>
inline std::uint8_t little_endian<std::uint8_t>(const std::uint8_t* bytes) {
  return *bytes;
}

}  // namespace lodestone

#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace lodestone {

/// How much of a file counts, and what it must hold.
struct FileExtent {
  std::uint64_t bytes = 0;
  std::uint64_t hash = 14695981039346656037ULL;  ///< FNV-1a of them
};

/// FNV-1a, 64 bits, continued from `hash`. It tells damage; it protects against nobody.
std::uint64_t hash_of(std::string_view bytes, std::uint64_t hash = FileExtent{}.hash);

/// A file that only grows. What a killed process added beyond a known extent is cut off when it is taken up again.
class GrowingFile {
 public:
  explicit GrowingFile(std::filesystem::path path) : path_(std::move(path)) {}

  const FileExtent& extent() const { return extent_; }

  /// Adds to the end of the extent. Throws InputError where the disk does not take it.
  void append(std::string_view bytes);

  /// The content of `extent`, which this goes on from. Throws InputError where the file holds anything else.
  std::string read(const FileExtent& extent);

 private:
  std::filesystem::path path_;
  FileExtent extent_;
};

}  // namespace lodestone

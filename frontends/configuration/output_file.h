#pragma once

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

namespace lodestone {

/// A file that appears under its name when it is complete: it is written under a temporary name and renamed by
/// `commit`. Without `commit`, the destructor deletes it. Throws InputError if the file cannot be written.
class OutputFile {
 public:
  explicit OutputFile(std::filesystem::path path);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  void write(std::string_view bytes);
  void write(std::span<const std::uint8_t> bytes);

  /// Replaces bytes that were written before, at `offset` from the file's begin. Further bytes follow them.
  void rewrite(long offset, std::string_view bytes);

  /// Closes and renames. No further bytes can be written.
  void commit();

 private:
  [[noreturn]] void fail(const std::string& reason);

  std::filesystem::path path_;
  std::filesystem::path aside_;
  std::FILE* file_ = nullptr;
};

}  // namespace lodestone

#pragma once

#include <cstdio>
#include <filesystem>
#include <string>
#include <string_view>

namespace lodestone {

/// A file that appears under its name when it is complete: it is written under a temporary name and renamed by
/// `commit`. Without `commit`, the destructor deletes it. Throws InputError if the folder cannot be written.
class OutputFile {
 public:
  explicit OutputFile(std::filesystem::path path);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  void write(std::string_view text);

  /// Closes and renames. Throws InputError if the disk is full.
  void commit();

 private:
  std::filesystem::path path_;
  std::filesystem::path aside_;
  std::FILE* file_ = nullptr;
};

/// Throws InputError if a folder of results cannot be created or written, before a long computation. Creates nothing.
void check_folder(const std::filesystem::path& folder);

/// Creates the folder if it does not exist. Throws InputError if this fails.
std::filesystem::path made_folder(const std::filesystem::path& folder);

/// The same, and deletes its content: results of an earlier call must not mix with new ones.
std::filesystem::path emptied_folder(const std::filesystem::path& folder);

/// Throws InputError if a file that --out names exists and the user did not allow to replace it.
void refuse_to_replace(const std::string& out, bool force);

/// The path of a file that --out names; creates its folder. Throws InputError if the name has another ending.
std::filesystem::path output_with_ending(const std::string& out, const std::string& ending);
inline std::filesystem::path yaml_output(const std::string& out) {
  return output_with_ending(out, ".yaml");
}

}  // namespace lodestone

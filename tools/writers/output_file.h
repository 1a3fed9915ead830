#pragma once

#include <cstdio>
#include <filesystem>
#include <string>
#include <string_view>

namespace lodestone {

/// A file that appears under its name only when it is whole: it is written beside it and renamed by `commit`.
/// Destroyed without `commit` it leaves nothing behind. Throws InputError where the folder cannot be written.
class OutputFile {
 public:
  explicit OutputFile(std::filesystem::path path);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  void write(std::string_view text);

  /// Closes and renames. Throws InputError where the disk did not take everything.
  void commit();

 private:
  std::filesystem::path path_;
  std::filesystem::path aside_;
  std::FILE* file_ = nullptr;
};

/// Throws InputError where a folder of results cannot be made or written there, before any time is spent on them. Makes
/// nothing.
void check_folder(const std::filesystem::path& folder);

/// The folder, made where it is not there. Throws InputError where that cannot be.
std::filesystem::path made_folder(const std::filesystem::path& folder);

/// The same, with nothing in it: what an earlier call left there must not stand beside what this one writes.
std::filesystem::path emptied_folder(const std::filesystem::path& folder);

/// The path of a YAML file that --out names, with its folder made. Throws InputError where the name has another ending.
std::filesystem::path yaml_output(const std::string& out);

}  // namespace lodestone

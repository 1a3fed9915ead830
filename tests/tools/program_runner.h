#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

namespace lodestone {

/// Result of a call of the real program.
struct ProgramResult {
  int code = -1;
  std::string output;  ///< standard output
  std::string errors;  ///< standard error
};

inline std::string content_of(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

/// A folder for one test, empty at first and removed at the end.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "lodestone-test-XXXXXX").string();
    path_ = mkdtemp(name.data());
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

/// Runs `lodestone ARGUMENTS` through the shell.
inline ProgramResult run_lodestone(const std::string& arguments) {
  const TemporaryFolder folder;
  const std::string command = std::string(LODESTONE_PROGRAM) + " " + arguments + " >" + (folder / "out").string() +
                              " 2>" + (folder / "err").string();
  const int status = std::system(command.c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, content_of(folder / "out"), content_of(folder / "err")};
}

/// Expects exit code 2, and one line on standard error that contains `expected`.
inline void expect_refused(const std::string& arguments, const std::string& expected) {
  const ProgramResult result = run_lodestone(arguments);
  EXPECT_EQ(result.code, 2) << arguments;
  EXPECT_EQ(std::count(result.errors.begin(), result.errors.end(), '\n'), 1) << result.errors;
  EXPECT_THAT(result.errors, ::testing::HasSubstr(expected));
}

inline std::filesystem::path data_folder() {
  const char* folder = std::getenv("LODESTONE_DATA");
  const std::filesystem::path source = LODESTONE_SOURCE_DIR;
  return folder != nullptr ? std::filesystem::path(folder) : source.parent_path() / "shared/data";
}

}  // namespace lodestone

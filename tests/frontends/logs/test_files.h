#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

namespace lodestone::testing {

/// Folder of the real data: LODESTONE_DATA, else ../shared/data beside the source folder.
inline std::filesystem::path real_data_folder() {
  const char* variable = std::getenv("LODESTONE_DATA");
  return variable != nullptr ? std::filesystem::path(variable)
                             : std::filesystem::path(LODESTONE_SOURCE_DIR) / "../shared/data";
}

/// A temporary folder of one test, removed with this object.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    const auto* test = ::testing::UnitTest::GetInstance()->current_test_info();
    std::string name =
        std::string("lodestone_") + test->test_suite_name() + "_" + test->name() + "_" + std::to_string(::getpid());
    for (char& character : name) {
      if (character == '/') character = '_';
    }
    path_ = std::filesystem::temp_directory_path() / name;
    std::filesystem::create_directories(path_);
  }
  ~TemporaryFolder() {
    std::error_code code;
    std::filesystem::remove_all(path_, code);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  std::string operator/(const std::string& name) const { return (path_ / name).string(); }
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

inline void write_text(const std::string& path, const std::string& text) {
  std::ofstream(path) << text;
}

/// The numbers of a file without a header, row by row; lines beginning with '#' are comments.
inline std::vector<std::vector<double>> read_csv(const std::filesystem::path& path) {
  std::ifstream stream(path);
  std::vector<std::vector<double>> rows;
  for (std::string line; std::getline(stream, line);) {
    if (line.empty() || line[0] == '#') continue;
    std::vector<double> row;
    std::stringstream cells(line);
    for (std::string cell; std::getline(cells, cell, ',');) row.push_back(std::stod(cell));
    rows.push_back(std::move(row));
  }
  return rows;
}

/// The message of the exception of type Error that `call` throws; the test fails if there is no such exception.
template <class Error, class Call>
std::string message_of(const Call& call) {
  try {
    call();
  } catch (const Error& error) {
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << "more than one line: " << error.what();
    return error.what();
  }
  ADD_FAILURE() << "no error was thrown";
  return {};
}

}  // namespace lodestone::testing

/// Skips the test, with the reason, if the file of the real data set is absent; otherwise defines `path`.
#define LODESTONE_REAL_DATA(path, name)                                                  \
  const std::string path = (::lodestone::testing::real_data_folder() / (name)).string(); \
  if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is absent; set LODESTONE_DATA to the real data"

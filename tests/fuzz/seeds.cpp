// lodestone_fuzz_seeds FOLDER: a valid input for every fuzzer, in FOLDER/BOUNDARY/valid.
#include <cstdio>
#include <exception>
#include <filesystem>

#include "tests/fuzz/boundaries/boundaries.h"

int main(int count, char** arguments) {
  namespace fs = std::filesystem;
  if (count != 2) {
    std::fprintf(stderr, "usage: lodestone_fuzz_seeds FOLDER\n");
    return 2;
  }
  try {
    for (const auto& boundary : lodestone::testing::boundaries()) {
      const fs::path scratch = fs::path(arguments[1]) / (boundary.name + ".part");
      const fs::path corpus = fs::path(arguments[1]) / boundary.name;
      fs::remove_all(scratch);
      fs::create_directories(scratch);
      fs::create_directories(corpus);
      boundary.write(scratch);
      fs::copy_file(scratch / boundary.file, corpus / "valid", fs::copy_options::overwrite_existing);
      fs::remove_all(scratch);
    }
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 2;
  }
  return 0;
}

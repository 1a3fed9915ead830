// The fuzzer: libFuzzer's bytes replace a boundary's file. The environment variable LODESTONE_BOUNDARY names the
// boundary.
#include <unistd.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "core/error.h"
#include "tests/fuzz/boundaries/boundaries.h"

namespace {

namespace fs = std::filesystem;
using lodestone::testing::Boundary;

struct Scratch {
  explicit Scratch(const std::string& name) : wanted(lodestone::testing::boundary(name)) {
    // A file system in memory if there is one: every input is written once.
    const fs::path parent = fs::exists("/dev/shm") ? fs::path("/dev/shm") : fs::temp_directory_path();
    folder = parent / ("lodestone-fuzz-" + std::to_string(getpid()));
    fs::create_directories(folder);
    wanted.write(folder);
  }
  ~Scratch() {
    std::error_code ignored;
    fs::remove_all(folder, ignored);
  }
  const Boundary& wanted;
  fs::path folder;
};

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* /*count*/, char*** /*arguments*/) {
  if (std::getenv("LODESTONE_BOUNDARY") != nullptr) return 0;
  std::fprintf(stderr, "set LODESTONE_BOUNDARY to a boundary's name; tools/fuzz.sh does\n");
  std::exit(2);
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const Scratch scratch(std::getenv("LODESTONE_BOUNDARY"));
  std::ofstream(scratch.folder / scratch.wanted.file, std::ios::binary)
      .write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
  try {
    scratch.wanted.read(scratch.folder);
  } catch (const lodestone::InputError&) {  // the only way to refuse an input; any other exception ends the fuzzer
  }
  return 0;
}

#pragma once

#include <filesystem>
#include <string>
#include <vector>

/// Every place where bytes of others come in, each with a small valid input: what the fuzzers and the tests of altered
/// bytes work on.
namespace lodestone::testing {

struct Boundary {
  std::string name;
  std::string file;                                    ///< below the folder: the one whose bytes are altered
  void (*write)(const std::filesystem::path& folder);  ///< a valid input, its companions included
  /// Reads all of it. Throws InputError where it is refused; anything else is a defect.
  void (*read)(const std::filesystem::path& folder);
};

const std::vector<Boundary>& boundaries();

/// Throws std::invalid_argument, naming those there are.
const Boundary& boundary(const std::string& name);

}  // namespace lodestone::testing

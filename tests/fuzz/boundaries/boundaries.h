#pragma once

#include <filesystem>
#include <string>
#include <vector>

/// All places where external bytes are read, each with a small valid input: used by the fuzzers and the tests with
/// altered bytes.
namespace lodestone::testing {

struct Boundary {
  std::string name;
  std::string file;                                    ///< below the folder: the one whose bytes are altered
  void (*write)(const std::filesystem::path& folder);  ///< a valid input, its companions included
  /// Reads the whole input. Throws InputError if it is refused; any other exception is a defect.
  void (*read)(const std::filesystem::path& folder);
};

const std::vector<Boundary>& boundaries();

/// Throws std::invalid_argument that lists the known names.
const Boundary& boundary(const std::string& name);

}  // namespace lodestone::testing

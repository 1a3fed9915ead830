#include "tools/writers/path_below.h"

namespace lodestone {

std::filesystem::path path_below(const std::string& path, const std::string& folder) {
  namespace fs = std::filesystem;
  const fs::path relative = fs::weakly_canonical(path).lexically_relative(fs::weakly_canonical(folder));
  return relative.empty() || *relative.begin() == ".." ? fs::path() : relative;
}

}  // namespace lodestone

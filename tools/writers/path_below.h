#pragma once

#include <filesystem>
#include <string>

namespace lodestone {

/// `path` as seen from `folder`, "." where it is that; empty where it is not below it. Neither need be there yet.
std::filesystem::path path_below(const std::string& path, const std::string& folder);

}  // namespace lodestone

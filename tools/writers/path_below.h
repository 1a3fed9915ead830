#pragma once

#include <filesystem>
#include <string>

namespace lodestone {

/// `path` relative to `folder`; "." if both are equal, empty if `path` is not below `folder`. Neither needs to exist.
std::filesystem::path path_below(const std::string& path, const std::string& folder);

}  // namespace lodestone

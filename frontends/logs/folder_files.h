#pragma once

#include <filesystem>
#include <vector>

namespace lodestone {

/// Every file below a folder, in order of name. Follows links to folders, so that a log can consist of files elsewhere.
/// Circular links are safe: each folder counts once, under its own name rather than a link's. Throws
/// std::filesystem::filesystem_error for unreadable parts of the folder itself; unreadable targets of links are
/// skipped.
std::vector<std::filesystem::path> files_below(const std::filesystem::path& folder);

}  // namespace lodestone

#pragma once

#include <filesystem>
#include <vector>

namespace lodestone {

/// Every file below a folder, in order of name. Links to folders are followed, so that a log can be put together of
/// what lies elsewhere. They may lead in circles: each folder counts once, under its own name before a link's. What may
/// not be read of the folder itself throws std::filesystem::filesystem_error; of what a link leads to it is passed
/// over.
std::vector<std::filesystem::path> files_below(const std::filesystem::path& folder);

}  // namespace lodestone

#pragma once

#include <filesystem>

namespace lodestone {

/// Writes one self-contained HTML file about `folder`: a run (summary.json), or an experiment of `lodestone reproduce`
/// (reproduce.json). The file opens from disk and makes no network requests. Returns its size in bytes. Throws
/// InputError if the folder is neither, or if a file in it is unusable.
std::size_t write_report(const std::filesystem::path& folder, const std::filesystem::path& out);

}  // namespace lodestone

#pragma once

#include <filesystem>

namespace lodestone {

/// Writes one self-contained HTML file about what is in `folder`: a run (summary.json), or everything that
/// `lodestone reproduce` made (reproduce.json). The file opens from disk and asks no network for anything.
/// Returns its size in bytes. Throws InputError where the folder is neither, or a file in it is unusable.
std::size_t write_report(const std::filesystem::path& folder, const std::filesystem::path& out);

}  // namespace lodestone

#pragma once

#include <filesystem>
#include <string>

namespace lodestone {

/// The whole file. Throws InputError, with the path, if it is missing or cannot be read.
std::string read_text_file(const std::string& path);

/// Writes a temporary file in the same folder and renames it, so that no reader sees a partial file. Throws InputError,
/// with the path, if this fails.
void write_text_file(const std::filesystem::path& path, const std::string& text);

}  // namespace lodestone

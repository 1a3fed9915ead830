#pragma once

#include <string>

namespace lodestone {

/// The whole file. Throws InputError, naming it, where it is missing or cannot be read.
std::string read_text_file(const std::string& path);

/// Writes the file aside in its folder and renames it, so that no reader ever sees half of it. Throws InputError,
/// naming it, where that fails.
void write_text_file(const std::string& path, const std::string& text);

}  // namespace lodestone

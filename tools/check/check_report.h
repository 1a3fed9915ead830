#pragma once

#include <filesystem>
#include <string>

#include "tools/check/check_call.h"

namespace lodestone {

/// "2 errors, 1 warning, 3 notes".
std::string summary_of(const Findings& findings);

/// Text for the terminal: the log's topics, then each finding and, below it, what to change.
std::string check_text(const CheckResult& result);

/// The same as JSON, written under a temporary name and renamed. Throws InputError if the file cannot be written.
void write_check_json(const std::filesystem::path& path, const CheckResult& result);

}  // namespace lodestone

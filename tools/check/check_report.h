#pragma once

#include <filesystem>
#include <string>

#include "tools/check/check_call.h"

namespace lodestone {

/// "2 errors, 1 warning, 3 notes".
std::string summary_of(const Findings& findings);

/// What a person reads: the log's topics, then every finding with what to change below it.
std::string check_text(const CheckResult& result);

/// The same as JSON, aside and renamed. Throws InputError where it cannot be written.
void write_check_json(const std::filesystem::path& path, const CheckResult& result);

}  // namespace lodestone

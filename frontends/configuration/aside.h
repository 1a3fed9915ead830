#pragma once

#include <string>

namespace lodestone {

/// Where a file is written until it is whole and renamed: beside it, `NAME.partial-PID`, so that two processes do not
/// meet there and leftovers of a killed one can be told.
std::string aside_name(const std::string& path);

/// Whether a file of this name was written aside, by whichever process.
bool is_aside_name(const std::string& name);

}  // namespace lodestone

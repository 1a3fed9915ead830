#pragma once

#include <string>

namespace lodestone {

/// Name of the temporary file that is written before the rename: `NAME.partial-PID` in the same folder, so that two
/// processes do not conflict and leftovers of a killed one are recognized.
std::string aside_name(const std::string& path);

/// Whether this is the name of such a temporary file, of any process.
bool is_aside_name(const std::string& name);

}  // namespace lodestone

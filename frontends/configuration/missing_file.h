#pragma once

#include <string>

#include "core/error.h"

namespace lodestone {

/// The error of a path that names nothing: "PATH: there is no such file", and the folder that is missing or the file
/// of the folder with the nearest name. `what` replaces "file".
InputError missing_file(const std::string& path, const std::string& what = "file");

}  // namespace lodestone

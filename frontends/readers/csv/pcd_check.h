#pragma once

#include <string>

namespace lodestone {

/// Holds a PCD file's header against itself and against the file's size, for PCL believes it: it takes memory for as many points
/// as are announced, and reads outside its buffers where lines are missing or disagree. Throws InputError.
void check_pcd(const std::string& path);

}  // namespace lodestone

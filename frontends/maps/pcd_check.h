#pragma once

#include <cstdint>
#include <string>

namespace lodestone {

/// Holds a PCD file's header against itself and against the file's size, for PCL believes it: it takes memory for as
/// many points as are announced, and reads outside its buffers where lines are missing or disagree. `most_bytes`: of
/// its points, unpacked, and never 4 GiB of a text's; `advice`: what to do with a broken one. VERSION, VIEWPOINT and
/// COUNT may be absent. Throws InputError.
void check_pcd(const std::string& path, std::uint64_t most_bytes, const std::string& advice);

}  // namespace lodestone

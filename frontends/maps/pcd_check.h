#pragma once

#include <cstdint>
#include <string>

namespace lodestone {

/// Checks a PCD file's header for consistency and against the file's size, because PCL trusts it: PCL allocates memory
/// for all announced points, and reads outside its buffers if lines are missing or inconsistent. `most_bytes`: limit of
/// the unpacked points (4 GiB for text); `advice`: remedy for the message. VERSION, VIEWPOINT and COUNT are optional.
/// Throws InputError.
void check_pcd(const std::string& path, std::uint64_t most_bytes, const std::string& advice);

}  // namespace lodestone

#pragma once

#include <string>
#include <string_view>

namespace lodestone {

/// The probable kind of a file, from its first bytes.
enum class SeemingKind { unknown, platform, magnetic_map, world, trajectory, point_cloud, log, raster };

/// The kind from the first text or bytes of a file.
SeemingKind seeming_kind(std::string_view begin);

/// "a platform file"; empty for unknown.
std::string_view kind_name(SeemingKind kind);

/// The kind from a file's first bytes; unknown if it cannot be read.
SeemingKind seeming_kind_of_file(const std::string& path);

/// Throws InputError if the file is probably of another kind: "FILE: expected a platform file; this looks like a
/// magnetic map". Unknown and missing files are left to the reader.
void require_kind(const std::string& path, SeemingKind expected, std::string_view expected_name);

/// "; this looks like a magnetic map", to be appended to a reader's message; empty if the kind is unknown.
std::string looks_like(const std::string& path);

}  // namespace lodestone

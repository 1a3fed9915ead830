#pragma once

#include <string>
#include <string_view>

namespace lodestone {

/// What a file seems to be, told by how it begins.
enum class SeemingKind { unknown, platform, magnetic_map, world, trajectory, point_cloud, log, raster };

/// Of the text or bytes with which a file begins.
SeemingKind seeming_kind(std::string_view begin);

/// "a platform file"; empty for unknown.
std::string_view kind_name(SeemingKind kind);

/// Of the file's first bytes; unknown where it cannot be read.
SeemingKind seeming_kind_of_file(const std::string& path);

/// Throws InputError where the file seems to be of another of our kinds: "FILE: expected a platform file; this looks
/// like a magnetic map". What is unknown, or missing, is the reader's to refuse.
void require_kind(const std::string& path, SeemingKind expected, std::string_view expected_name);

/// "; this looks like a PCD or PLY file", to be added to a reader's refusal; empty where the file seems to be nothing
/// of ours.
std::string looks_like(const std::string& path);

}  // namespace lodestone

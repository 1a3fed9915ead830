#include "frontends/configuration/file_kind.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <set>

#include "core/error.h"
#include "frontends/configuration/number_text.h"

namespace lodestone {
namespace {

constexpr std::size_t kLookedAt = 1 << 16;  // bytes

/// Removes and returns the first line of the text.
std::string_view take_line(std::string_view& text) {
  const std::size_t end = std::min(text.find('\n'), text.size());
  const std::string_view line = text.substr(0, end);
  text.remove_prefix(std::min(end + 1, text.size()));
  return line;
}

SeemingKind kind_of_bytes(std::string_view begin) {
  using namespace std::string_view_literals;
  for (const std::string_view magic : {"#ROSBAG V"sv, "\x89MCAP"sv, "SQLite format 3"sv}) {
    if (begin.starts_with(magic)) return SeemingKind::log;
  }
  if (begin.starts_with("ply\n") || begin.starts_with("ply\r") || begin.starts_with("# .PCD") ||
      begin.starts_with("LASF"))
    return SeemingKind::point_cloud;
  for (const std::string_view magic : {"II*\0"sv, "MM\0*"sv, "II+\0"sv, "MM\0+"sv}) {
    if (begin.starts_with(magic)) return SeemingKind::raster;
  }
  return SeemingKind::unknown;
}

/// Whether a line has eight numbers: a stamp and a pose.
bool is_tum_line(std::string_view line) {
  int numbers = 0;
  while (true) {
    line.remove_prefix(std::min(line.find_first_not_of(" \t\r"), line.size()));
    if (line.empty()) return numbers == 8;
    const std::string_view word = line.substr(0, line.find_first_of(" \t\r"));
    double value = 0.0;
    if (!parse_number(word, value)) return false;
    ++numbers;
    line.remove_prefix(word.size());
  }
}

/// From the keys at the beginning of lines.
SeemingKind kind_of_yaml(std::string_view text) {
  std::set<std::string_view> keys;
  while (!text.empty()) {
    const std::string_view line = take_line(text);
    const std::size_t colon = line.find_first_of(": #\t");
    if (colon != std::string_view::npos && colon > 0 && line[colon] == ':') keys.insert(line.substr(0, colon));
  }
  const auto has = [&keys](std::string_view key) { return keys.count(key) > 0; };
  if (has("resolution_m") && has("origin_m") && has("image")) return SeemingKind::magnetic_map;
  if (has("sensors") && has("sequences")) return SeemingKind::world;
  if (has("imu") && has("lidar") && has("magnetometers")) return SeemingKind::platform;
  return SeemingKind::unknown;
}

}  // namespace

SeemingKind seeming_kind(std::string_view begin) {
  if (const SeemingKind kind = kind_of_bytes(begin); kind != SeemingKind::unknown) return kind;
  for (std::string_view rest = begin; !rest.empty();) {
    const std::string_view line = take_line(rest);
    if (line.empty() || line.front() == '#' || line == "\r") continue;
    if (line.starts_with("VERSION ") || line.starts_with("FIELDS ")) return SeemingKind::point_cloud;
    if (is_tum_line(line)) return SeemingKind::trajectory;
    break;
  }
  return kind_of_yaml(begin);
}

std::string_view kind_name(SeemingKind kind) {
  switch (kind) {
    case SeemingKind::platform:
      return "a platform file";
    case SeemingKind::magnetic_map:
      return "a magnetic map";
    case SeemingKind::world:
      return "a world of lodestone simulate";
    case SeemingKind::trajectory:
      return "a trajectory (TUM)";
    case SeemingKind::point_cloud:
      return "a point cloud (PCD, PLY or LAS)";
    case SeemingKind::log:
      return "a log";
    case SeemingKind::raster:
      return "a TIFF";
    case SeemingKind::unknown:
      break;
  }
  return "";
}

SeemingKind seeming_kind_of_file(const std::string& path) {
  std::error_code code;
  if (!std::filesystem::is_regular_file(path, code)) return SeemingKind::unknown;
  std::ifstream stream(path, std::ios::binary);
  std::string begin(kLookedAt, '\0');
  stream.read(begin.data(), static_cast<std::streamsize>(begin.size()));
  begin.resize(static_cast<std::size_t>(std::max<std::streamsize>(stream.gcount(), 0)));
  return seeming_kind(begin);
}

void require_kind(const std::string& path, SeemingKind expected, std::string_view expected_name) {
  const SeemingKind kind = seeming_kind_of_file(path);
  if (kind == SeemingKind::unknown || kind == expected) return;
  throw InputError(path + ": expected " + std::string(expected_name) + looks_like(path));
}

std::string looks_like(const std::string& path) {
  const SeemingKind kind = seeming_kind_of_file(path);
  return kind == SeemingKind::unknown ? std::string() : "; this looks like " + std::string(kind_name(kind));
}

}  // namespace lodestone

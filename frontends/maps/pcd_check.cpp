#include "frontends/maps/pcd_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <sstream>
#include <vector>

#include "core/error.h"
#include "frontends/configuration/number_text.h"
#include "frontends/file_bytes.h"

namespace lodestone {
namespace {

constexpr std::uint64_t largest_number = 1ULL << 31;

/// PCL counts the bytes of a text's points in 32 bits; further points overwrite the first ones.
constexpr std::uint64_t most_bytes_of_text = (1ULL << 32) - 1;

/// The header's lines by their first words.
struct Header {
  std::string path, advice;
  std::map<std::string, std::vector<std::string>> lines;
  std::uint64_t data_offset = 0;

  [[noreturn]] void fail(const std::string& what) const {
    throw InputError(fmt::format("{}: is not a PCD file, or is cut off or damaged: {}; {}", path, what, advice));
  }
  const std::vector<std::string>& words(const char* key, std::size_t count) const {
    const auto found = lines.find(key);
    if (found == lines.end()) fail(fmt::format("the header has no line {}", key));
    if (found->second.size() != count) {
      fail(fmt::format("the line {} has {} words; expected {}", key, found->second.size(), count));
    }
    return found->second;
  }
  bool has(const char* key) const { return lines.count(key) > 0; }
  std::uint64_t number(const char* key, std::size_t count, std::size_t index) const {
    const std::string& word = words(key, count)[index];
    std::uint64_t value = 0;
    if (!parse_number(word, value) || value > largest_number) {
      fail(fmt::format("invalid '{}' in the line {}", word, key));
    }
    return value;
  }
};

Header read_header(const std::string& path, const std::string& advice) {
  Header header;
  header.path = path;
  header.advice = advice;
  std::ifstream stream(path, std::ios::binary);
  std::string line;
  for (int number = 0; number < 100 && std::getline(stream, line); ++number) {
    std::istringstream words(line);
    std::string key, word;
    if (line.empty()) continue;
    // PCL treats a blank line (or an empty one with Windows line ending) as the header's end, and continues without it.
    if (!(words >> key)) header.fail("a blank line in the header");
    if (key.front() == '#') continue;
    const auto [entry, is_new] = header.lines.try_emplace(key);
    if (!is_new) header.fail(fmt::format("there are two lines {}", key));
    while (words >> word) entry->second.push_back(word);
    if (key != "DATA") continue;
    if (stream.eof()) header.fail("nothing follows the header");
    header.data_offset = static_cast<std::uint64_t>(stream.tellg());
    return header;
  }
  header.fail("the header has no line DATA");
}

/// PCL continues reading a header after its last line as long as lines look like header lines: values must not.
void check_end_of_header(const Header& header) {
  std::ifstream stream(header.path, std::ios::binary);
  stream.seekg(static_cast<std::streamoff>(header.data_offset));
  for (std::string line; std::getline(stream, line);) {
    std::string word;
    std::istringstream(line) >> word;
    if (word.empty() || word.front() == '#') continue;
    for (const char* key :
         {"VERSION", "FIELDS", "COLUMNS", "SIZE", "TYPE", "COUNT", "WIDTH", "HEIGHT", "VIEWPOINT", "POINTS", "DATA"}) {
      if (word.starts_with(key)) header.fail(fmt::format("a line {} after the line DATA", key));
    }
    return;
  }
}

/// The number of non-empty lines from `offset` on.
std::uint64_t lines_of_values(const std::string& path, std::uint64_t offset) {
  std::ifstream stream(path, std::ios::binary);
  stream.seekg(static_cast<std::streamoff>(offset));
  std::uint64_t lines = 0;
  for (std::string line; std::getline(stream, line);) {
    if (line.find_first_not_of(" \t\r") != std::string::npos) ++lines;
  }
  return lines;
}

}  // namespace

void check_pcd(const std::string& path, std::uint64_t most_bytes, const std::string& advice) {
  const Header header = read_header(path, advice);
  static const std::vector<std::string> known{"VERSION", "FIELDS", "SIZE",   "TYPE", "COUNT",
                                              "WIDTH",   "HEIGHT", "POINTS", "DATA", "VIEWPOINT"};
  for (const auto& [key, words] : header.lines) {
    if (std::find(known.begin(), known.end(), key) == known.end())
      header.fail(fmt::format("an unknown line '{}'", key));
  }
  if (header.has("VERSION")) header.words("VERSION", 1);
  if (header.has("VIEWPOINT")) header.words("VIEWPOINT", 7);
  const auto named = header.lines.find("FIELDS");
  if (named == header.lines.end() || named->second.empty()) header.fail("there are no fields");
  const std::size_t fields = named->second.size();
  std::uint64_t point_bytes = 0, values = 0;
  for (std::size_t i = 0; i < fields; ++i) {
    const std::uint64_t size = header.number("SIZE", fields, i),
                        count = header.has("COUNT") ? header.number("COUNT", fields, i) : 1;
    const std::string& type = header.words("TYPE", fields)[i];
    const bool floating = type == "F" && (size == 4 || size == 8);
    const bool integer = (type == "I" || type == "U") && (size == 1 || size == 2 || size == 4 || size == 8);
    if ((!floating && !integer) || count == 0)
      header.fail(fmt::format("an invalid field of {} values of type {} and {} bytes", count, type, size));
    point_bytes = std::min(point_bytes + size * count, most_bytes);
    values = std::min(values + count, most_bytes);
  }
  const std::uint64_t points = header.number("POINTS", 1, 0);
  if (header.number("WIDTH", 1, 0) * header.number("HEIGHT", 1, 0) != points)
    header.fail("WIDTH x HEIGHT is not POINTS");
  const std::string& kind = header.words("DATA", 1)[0];
  if (kind == "ascii" && points > most_bytes_of_text / point_bytes) {
    throw InputError(
        fmt::format("{}: {} points of {} bytes as text, of which at most {} can be read; write the cloud as "
                    "binary PCD or as PLY",
                    path, points, point_bytes, most_bytes_of_text / point_bytes));
  }
  if (points > most_bytes / point_bytes) header.fail(fmt::format("{} points of {} bytes", points, point_bytes));
  check_end_of_header(header);
  const FileBytes file(path);
  const std::uint64_t there = file.size() - header.data_offset;
  const std::uint64_t bytes = points * point_bytes;
  std::uint64_t needed = 0;
  if (kind == "ascii") {
    needed = points * values;  // at least one character per value
  } else if (kind == "binary") {
    needed = bytes;
  } else if (kind == "binary_compressed") {
    std::vector<std::uint8_t> sizes;
    if (there < 8) header.fail("nothing follows the header");
    file.read(header.data_offset, 8, sizes);
    needed = 8 + std::uint64_t{little_endian<std::uint32_t>(sizes.data())};
    if (little_endian<std::uint32_t>(sizes.data() + 4) != bytes)
      header.fail("the packed points have another size than announced");
    constexpr std::uint64_t most_of_a_byte = 88;  // LZF unpacks three bytes to at most 264
    if (bytes > most_of_a_byte * there) header.fail(fmt::format("it announces {} bytes, packed in {}", bytes, there));
  } else {
    header.fail(fmt::format("invalid '{}' in the line DATA", kind));
  }
  if (there < needed) {
    header.fail(fmt::format("the header announces {} points, which require {} bytes, but {} bytes follow", points,
                            needed, there));
  }
  if (kind != "ascii") return;
  const std::uint64_t lines = lines_of_values(path, header.data_offset);
  if (lines < points)
    header.fail(fmt::format("the header announces {} points, but {} lines of values follow", points, lines));
}

}  // namespace lodestone

#pragma once

#include <algorithm>
#include <string_view>
#include <vector>

namespace lodestone {

inline std::string_view trimmed(std::string_view text) {
  const auto begin = text.find_first_not_of(" \t\r");
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(" \t\r") - begin + 1);
}

/// The separator of a line's cells: semicolon, tab, comma, or else blanks.
inline char separator_of(std::string_view line) {
  for (const char separator : {';', '\t', ','}) {
    if (line.find(separator) != std::string_view::npos) return separator;
  }
  return ' ';
}

/// The cells of a line, trimmed. With a blank as `separator`, any run of blanks and tabs separates.
inline std::vector<std::string_view> split_cells(std::string_view line, char separator = ',') {
  std::vector<std::string_view> parts;
  if (separator == ' ') {
    for (std::size_t begin = line.find_first_not_of(" \t"); begin < line.size();) {
      const std::size_t end = std::min(line.find_first_of(" \t", begin), line.size());
      parts.push_back(line.substr(begin, end - begin));
      begin = std::min(line.find_first_not_of(" \t", end), line.size());
    }
    return parts;
  }
  for (std::size_t begin = 0; begin <= line.size();) {
    const std::size_t end = std::min(line.find(separator, begin), line.size());
    parts.push_back(trimmed(line.substr(begin, end - begin)));
    begin = end + 1;
  }
  return parts;
}

}  // namespace lodestone

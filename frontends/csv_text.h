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

/// The values of a line between any of `separators`, without empty ones.
inline std::vector<std::string_view> split_line(std::string_view text, std::string_view separators) {
  std::vector<std::string_view> parts;
  for (std::size_t begin = text.find_first_not_of(separators); begin != std::string_view::npos;) {
    const std::size_t end = std::min(text.find_first_of(separators, begin), text.size());
    parts.push_back(text.substr(begin, end - begin));
    begin = text.find_first_not_of(separators, end);
  }
  return parts;
}

/// The cells of a line, trimmed. With a blank as `separator`, any run of blanks and tabs separates.
inline std::vector<std::string_view> split_cells(std::string_view line, char separator = ',') {
  if (separator == ' ') return split_line(line, " \t");
  std::vector<std::string_view> parts;
  for (std::size_t begin = 0; begin <= line.size();) {
    const std::size_t end = std::min(line.find(separator, begin), line.size());
    parts.push_back(trimmed(line.substr(begin, end - begin)));
    begin = end + 1;
  }
  return parts;
}

}  // namespace lodestone

#pragma once

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>

#include "core/error.h"
#include "frontends/configuration/number_text.h"
#include "frontends/csv_text.h"

/// Lines of a text with a table of numbers, as trajectories are.
namespace lodestone {

/// One line, with its file and number for messages.
struct TableLine {
  const std::string& path;
  int number;
  std::string_view text;

  [[noreturn]] void fail(const std::string& message) const {
    throw InputError(path + ":" + std::to_string(number) + ": " + message);
  }
};

inline bool parse_finite(std::string_view text, double& value) {
  return parse_number(text, value) && std::isfinite(value);
}

/// Calls `call` for each line that is neither empty nor a comment (#). `call` may return false to stop. A byte-order
/// mark, which some spreadsheets write, is no part of the text.
template <class Call>
void for_each_line(const std::string& path, const std::string& text, const Call& call) {
  TableLine line{path, 0, {}};
  for (std::size_t begin = text.starts_with("\xEF\xBB\xBF") ? 3 : 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    line.text = std::string_view(text).substr(begin, end - begin);
    ++line.number;
    begin = end + 1;
    const std::size_t first = line.text.find_first_not_of(" \t\r");
    if (first == std::string_view::npos || line.text[first] == '#') continue;
    if (!call(line)) return;
  }
}

}  // namespace lodestone

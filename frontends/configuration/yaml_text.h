#pragma once

#include <string>

namespace lodestone {

/// `text` as a quoted YAML scalar on one line.
inline std::string quoted_yaml(const std::string& text) {
  std::string result = "\"";
  for (const char letter : text) {
    if (letter == '"' || letter == '\\') result += '\\';
    result += letter == '\n' ? ' ' : letter;
  }
  return result + "\"";
}

}  // namespace lodestone

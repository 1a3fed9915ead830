#pragma once

#include <charconv>
#include <string_view>
#include <system_error>

namespace lodestone {

/// Parses the whole text as a number: "12", "+7", "-3.5e2", "nan", "inf". Independent of the locale. Returns false and
/// keeps `number` if the text is empty, has other characters, or if the number is out of range.
template <class Number>
bool parse_number(std::string_view text, Number& number) {
  if (text.starts_with('+') && !text.starts_with("+-")) text.remove_prefix(1);
  Number parsed{};
  const auto result = std::from_chars(text.data(), text.data() + text.size(), parsed);
  if (result.ec != std::errc() || result.ptr != text.data() + text.size()) return false;
  number = parsed;
  return true;
}

}  // namespace lodestone

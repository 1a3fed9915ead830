#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace lodestone {

/// The number of insertions, deletions and replacements of letters, and swaps of neighbours, from one name to the
/// other.
int edit_distance(std::string_view a, std::string_view b);

/// The name nearest to `wrong` by edit distance, the first of equals; empty if `names` is empty.
std::string nearest_name(std::string_view wrong, const std::vector<std::string>& names);

/// "; did you mean 'NAME'?" with the nearest name, if up to a third of the longer name's letters, rounded up, differ.
/// Otherwise empty.
std::string suggestion(std::string_view wrong, const std::vector<std::string>& names);

/// The names of all elements in one line: "a, b, c". `name_of`: of an element, for std::invoke.
template <class Range, class Name = std::identity>
std::string join_names(Range&& elements, Name name_of = {}) {
  std::string line;
  for (const auto& element : elements) {
    if (!line.empty()) line += ", ";
    line += std::invoke(name_of, element);
  }
  return line;
}

}  // namespace lodestone

#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace lodestone {

/// The number of letters to insert, delete or replace, or of neighbours to swap, to turn one name into the other.
int edit_distance(std::string_view a, std::string_view b);

/// The name nearest to `wrong` by edit distance, the first of equals; empty where `names` is.
std::string nearest_name(std::string_view wrong, const std::vector<std::string>& names);

/// "; did you mean 'NAME'?" with the nearest name where it is near: up to a third of the longer one's letters, rounded
/// up, are another; empty where none is.
std::string suggestion(std::string_view wrong, const std::vector<std::string>& names);

/// The names in one line: "a, b, c".
std::string join_names(const std::vector<std::string>& names);

}  // namespace lodestone

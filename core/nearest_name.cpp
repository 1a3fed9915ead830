#include "core/nearest_name.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace lodestone {

int edit_distance(std::string_view a, std::string_view b) {
  std::vector<int> row(b.size() + 1), last(b.size() + 1), before_last;
  std::iota(row.begin(), row.end(), 0);
  for (std::size_t i = 0; i < a.size(); ++i) {
    before_last = std::exchange(last, row);
    row[0] = static_cast<int>(i) + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      row[j + 1] = std::min({last[j] + (a[i] == b[j] ? 0 : 1), row[j] + 1, last[j + 1] + 1});
      const bool swapped = i > 0 && j > 0 && a[i] == b[j - 1] && a[i - 1] == b[j];
      if (swapped) row[j + 1] = std::min(row[j + 1], before_last[j - 1] + 1);
    }
  }
  return row.back();
}

std::string nearest_name(std::string_view wrong, const std::vector<std::string>& names) {
  const auto nearest = std::min_element(names.begin(), names.end(), [&](const std::string& a, const std::string& b) {
    return edit_distance(wrong, a) < edit_distance(wrong, b);
  });
  return nearest == names.end() ? std::string() : *nearest;
}

std::string suggestion(std::string_view wrong, const std::vector<std::string>& names) {
  const std::string nearest = nearest_name(wrong, names);
  const std::size_t longer = std::max(wrong.size(), nearest.size());
  if (nearest.empty() || static_cast<std::size_t>(edit_distance(wrong, nearest)) > (longer + 2) / 3) return {};
  return "; did you mean '" + nearest + "'?";
}

}  // namespace lodestone

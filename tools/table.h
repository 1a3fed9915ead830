#pragma once

#include <string>
#include <vector>

namespace lodestone {

/// A table for the terminal: the first column is left-aligned, all others are right-aligned, with a rule below the
/// header.
class Table {
 public:
  explicit Table(std::vector<std::string> header) : rows_{std::move(header)} {}

  /// Cells beyond the header's count are dropped; missing cells are empty.
  void add(std::vector<std::string> cells) { rows_.push_back(std::move(cells)); }

  /// Lines ended by newlines.
  std::string to_string() const;

 private:
  std::vector<std::vector<std::string>> rows_;
};

/// `value` with `digits` decimals; an en dash if it is not finite.
std::string fixed(double value, int digits);

}  // namespace lodestone

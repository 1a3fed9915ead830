#include "tools/table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace lodestone {

namespace {

/// Columns on the terminal: UTF-8 continuation bytes have no width.
std::size_t display_width(const std::string& text) {
  return static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; }));
}

}  // namespace

std::string Table::to_string() const {
  const std::size_t columns = rows_.front().size();
  std::vector<std::size_t> widths(columns, 0);
  for (const auto& row : rows_) {
    for (std::size_t column = 0; column < std::min(columns, row.size()); ++column) {
      widths[column] = std::max(widths[column], display_width(row[column]));
    }
  }
  std::string text;
  for (std::size_t index = 0; index < rows_.size(); ++index) {
    std::string line;
    for (std::size_t column = 0; column < columns; ++column) {
      const std::string cell = column < rows_[index].size() ? rows_[index][column] : "";
      const std::string padding(widths[column] - display_width(cell), ' ');
      if (column > 0) line += "  ";
      line += column == 0 ? cell + padding : padding + cell;
    }
    line.erase(line.find_last_not_of(' ') + 1);
    text += line + "\n";
    if (index == 0) {
      for (std::size_t column = 0; column < columns; ++column) {
        if (column > 0) text += "  ";
        for (std::size_t i = 0; i < widths[column]; ++i) text += "─";
      }
      text += "\n";
    }
  }
  return text;
}

std::string fixed(double value, int digits) {
  return std::isfinite(value) ? fmt::format("{:.{}f}", value, digits) : "–";
}

}  // namespace lodestone

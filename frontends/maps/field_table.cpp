#include "frontends/maps/field_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>

#include "core/error.h"
#include "core/nearest_name.h"
#include "frontends/configuration/file_kind.h"
#include "frontends/configuration/missing_file.h"
#include "frontends/configuration/number_text.h"
#include "frontends/csv_text.h"

namespace lodestone {
namespace {

/// Columns of a table, by content.
enum Column { x, y, z, field_x, field_y, field_z, sigma, columns };

/// Letters and digits only, lower case: "B_x [uT]" is "bxut".
std::string normalized_name(std::string_view name) {
  std::string result;
  for (const char letter : name) {
    if (std::isalnum(static_cast<unsigned char>(letter)) != 0) {
      result += static_cast<char>(std::tolower(static_cast<unsigned char>(letter)));
    } else if (letter == '\xC2' || letter == '\xCE') {
      result += 'u';  // the first byte of either micro sign; the second is skipped
    }
  }
  return result;
}

bool strip_suffix(std::string& name, std::string_view ending) {
  if (name.size() <= ending.size() || !name.ends_with(ending)) return false;
  name.resize(name.size() - ending.size());
  return true;
}

/// Meaning of a column's name; `columns` if it is unknown.
struct ColumnName {
  explicit ColumnName(std::string_view text) : name(normalized_name(text)) {
    if (find()) return;
    const std::string whole = name;
    const std::pair<const char*, FieldUnit> units[] = {{"microtesla", FieldUnit::microtesla},
                                                       {"nanotesla", FieldUnit::nanotesla},
                                                       {"milligauss", FieldUnit::milligauss},
                                                       {"tesla", FieldUnit::tesla},
                                                       {"gauss", FieldUnit::gauss},
                                                       {"ut", FieldUnit::microtesla},
                                                       {"nt", FieldUnit::nanotesla},
                                                       {"mg", FieldUnit::milligauss},
                                                       {"t", FieldUnit::tesla}};
    for (const auto& [ending, value] : units) {
      name = whole;
      if (!strip_suffix(name, ending) || !find() || kind < field_x) continue;
      unit = value;
      return;
    }
    for (const char* ending : {"mm", "cm", "metres", "meters", "m"}) {
      name = whole;
      if (!strip_suffix(name, ending) || !find() || kind > z) continue;
      length_unit = ending;
      return;
    }
    kind = columns;
  }

  bool find() {
    static const std::vector<std::string> stems{"", "pos", "position", "p", "map"};
    static const std::vector<std::string> field_stems{"b",      "mag",           "m", "field",
                                                      "bfield", "magneticfield", "h", "magnetic"};
    kind = columns;
    for (int axis = 0; axis < 3; ++axis) {
      const std::string letter(1, "xyz"[axis]);
      for (const std::string& stem : stems) {
        if (name == stem + letter) kind = static_cast<Column>(x + axis);
      }
      for (const std::string& stem : field_stems) {
        if (name == stem + letter) kind = static_cast<Column>(field_x + axis);
      }
    }
    if (name == "height") kind = z;
    for (const std::string stem : {"sigma", "std", "stddev", "uncertainty"}) {
      if (name == stem) kind = sigma;
      for (const char letter : {'x', 'y', 'z'}) sigma_of_an_axis = sigma_of_an_axis || name == stem + letter;
    }
    return kind != columns;
  }

  std::string name;
  Column kind = columns;
  bool sigma_of_an_axis = false;
  std::optional<FieldUnit> unit;
  std::string length_unit;
};

class TableReader {
 public:
  explicit TableReader(const std::string& path) : path_(path) {}

  FieldTable read() {
    std::error_code code;
    if (!std::filesystem::exists(path_, code)) throw missing_file(path_);
    if (!std::filesystem::is_regular_file(path_, code))
      throw InputError(path_ + ": expected a text table, but this is not a file");
    const SeemingKind kind = seeming_kind_of_file(path_);
    if (kind == SeemingKind::log || kind == SeemingKind::point_cloud || kind == SeemingKind::raster) {
      throw InputError(path_ + ": expected a table of x, y, z, Bx, By, Bz in text" + looks_like(path_));
    }
    std::ifstream file(path_, std::ios::binary);
    if (!file) throw InputError(path_ + ": cannot be opened for reading; check its permissions");
    for (std::string line; std::getline(file, line);) {
      ++number_;
      std::string_view text = trimmed(line);
      if (number_ == 1 && text.starts_with("\xEF\xBB\xBF"))
        text.remove_prefix(3);  // byte-order mark of some spreadsheets
      if (!text.empty()) take(text);
    }
    if (table_.rows.empty())
      throw InputError(path_ + ": there is no line of numbers; expected x, y, z and the field's three components");
    return std::move(table_);
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw InputError(fmt::format("{}:{}: {}", path_, number_, what));
  }

  void take(std::string_view text) {
    const bool comment = text.front() == '#' || text.front() == '%';
    if (comment) text = trimmed(text.substr(1));
    if (comment && (ordered_ || text.empty())) return;
    if (!ordered_) separator_ = separator_of(text);
    const std::vector<std::string_view> cells = split_cells(text, separator_);
    if (!ordered_) {
      double ignored = 0.0;
      const bool words =
          std::none_of(cells.begin(), cells.end(), [&](auto cell) { return parse_number(cell, ignored); });
      if (words && (parse_header(cells) || comment)) return;
      if (words) {
        fail(
            fmt::format("found the columns {}; expected x, y, z, Bx, By, Bz, and optionally sigma", join_names(cells)));
      }
      if (comment) return;
      take_order(cells.size());
    }
    if (!comment) parse_numbers(cells);
  }

  bool parse_header(const std::vector<std::string_view>& cells) {
    std::array<int, columns> places;
    places.fill(-1);
    std::size_t with_unit = 0;
    std::string_view of_an_axis;
    for (std::size_t i = 0; i < cells.size(); ++i) {
      const ColumnName name(cells[i]);
      if (name.sigma_of_an_axis && of_an_axis.empty()) of_an_axis = cells[i];
      if (name.kind == columns) continue;
      int& place = places[name.kind];
      if (place >= 0) fail(fmt::format("two columns have the meaning of '{}'; rename or remove one", cells[i]));
      place = static_cast<int>(i);
      if (name.length_unit == "mm" || name.length_unit == "cm") {
        fail(fmt::format("the column '{}' is in {}; expected metres", cells[i], name.length_unit));
      }
      table_.names_metres = table_.names_metres || !name.length_unit.empty();
      if (name.kind >= field_x && name.unit) {
        if (table_.unit && table_.unit != name.unit) {
          fail(fmt::format("the columns '{}' and '{}' have different units; use one unit for field and sigma",
                           cells[with_unit], cells[i]));
        }
        table_.unit = name.unit;
        with_unit = i;
      }
    }
    for (const Column needed : {x, y, field_x, field_y, field_z}) {
      if (places[needed] < 0) {
        table_.unit.reset();
        table_.names_metres = false;
        return false;
      }
    }
    if (places[sigma] < 0 && !of_an_axis.empty()) {
      fail(fmt::format(
          "the column '{}' is the sigma of one axis; expected one column 'sigma' for all three: use the largest",
          of_an_axis));
    }
    places_ = places;
    table_.has_height = places[z] >= 0;
    return ordered_ = true;
  }

  void take_order(std::size_t cells) {
    if (cells < 5 || cells > 7) {
      fail(fmt::format(
          "{} columns without names; expected x y z Bx By Bz, x y z Bx By Bz sigma, or x y Bx By Bz; name the columns "
          "in a header line",
          cells));
    }
    table_.has_height = cells > 5;
    int next = 0;
    for (int column = 0; column < columns; ++column) {
      const bool absent = (column == z && cells == 5) || (column == sigma && cells < 7);
      places_[static_cast<std::size_t>(column)] = absent ? -1 : next++;
    }
    ordered_ = true;
  }

  void parse_numbers(const std::vector<std::string_view>& cells) {
    // Trailing tabs, which end empty cells, were trimmed.
    const auto expected = static_cast<std::size_t>(*std::max_element(places_.begin(), places_.end())) + 1;
    if (cells.size() < expected && separator_ != '\t') {
      fail(fmt::format("expected {} columns, found {}; complete the line or remove it", expected, cells.size()));
    }
    FieldTableRow row;
    row.line = number_;
    for (std::size_t column = 0; column < columns; ++column) {
      if (places_[column] < 0) continue;
      const auto place = static_cast<std::size_t>(places_[column]);
      const std::string_view cell = place < cells.size() ? cells[place] : std::string_view();
      double value = 0.0;
      if (!parse_number(cell, value)) {
        if (column < field_x || !cell.empty()) fail(fmt::format("'{}' is not a number, in column {}", cell, place + 1));
        value = std::numeric_limits<double>::quiet_NaN();  // an empty cell is a node without field
      }
      if (column < field_x) {
        if (!std::isfinite(value)) fail(fmt::format("'{}' is not a position, in column {}", cell, place + 1));
        row.position[column] = value;
      } else if (column < sigma) {
        row.field[column - field_x] = value;
      } else {
        if (!(value >= 0.0)) fail(fmt::format("'{}' is not a sigma, in column {}", cell, place + 1));
        row.sigma = value;
      }
    }
    table_.rows.push_back(row);
  }

  std::string path_;
  int number_ = 0;
  char separator_ = ',';
  bool ordered_ = false;  ///< whether `places_` is set
  std::array<int, columns> places_{};
  FieldTable table_;
};

}  // namespace

FieldTable read_field_table(const std::string& path) {
  return TableReader(path).read();
}

}  // namespace lodestone

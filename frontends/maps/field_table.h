#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "frontends/configuration/platform.h"

namespace lodestone {

/// One line of a field map that others wrote as text.
struct FieldTableRow {
  std::array<double, 3> position{};  ///< m, map
  std::array<double, 3> field{};     ///< in the table's unit, along the map's axes; NaN: none
  double sigma = -1.0;               ///< in the table's unit; negative: the table has none
  int line = 0;                      ///< of the file
};

/// A table of positions and field vectors.
struct FieldTable {
  std::vector<FieldTableRow> rows;
  std::optional<FieldUnit> unit;  ///< where the header names it: Bx_uT, "Bx [nT]"
  bool has_height = false;        ///< whether there was a column z
  bool names_metres = false;      ///< whether the header does: x_m, "y [m]"
};

/// Reads a CSV of x, y, z (m), B_x, B_y, B_z and perhaps sigma: separated by commas, semicolons, tabs or blanks; '#'
/// starts a comment. A first line with words names the columns, in any order, under the names that people use (x_m,
/// pos_x, Bx, mag_x, field_x_ut); further columns are not looked at. Without one, they are the six, or seven, in this
/// order; five are x, y and the field. Throws InputError, with file and line.
FieldTable read_field_table(const std::string& path);

}  // namespace lodestone

#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "frontends/configuration/platform.h"

namespace lodestone {

/// One line of another program's field map in text form.
struct FieldTableRow {
  std::array<double, 3> position{};  ///< m, map
  std::array<double, 3> field{};     ///< in the table's unit, along the map's axes; NaN: none
  double sigma = -1.0;               ///< in the table's unit; negative: the table has none
  int line = 0;                      ///< line number in the file
};

/// A table of positions and field vectors.
struct FieldTable {
  std::vector<FieldTableRow> rows;
  std::optional<FieldUnit> unit;  ///< if the header has it: Bx_uT, "Bx [nT]"
  bool has_height = false;        ///< whether there is a column z
  bool names_metres = false;      ///< whether the header states metres: x_m, "y [m]"
};

/// Reads a CSV of x, y, z (m), B_x, B_y, B_z and optionally sigma, separated by commas, semicolons, tabs or blanks; '#'
/// begins a comment. A header line names the columns in any order, with common names (x_m, pos_x, Bx, mag_x,
/// field_x_ut); other columns are ignored. Without a header, six or seven columns have this order; five are x, y and
/// the field. Throws InputError with file and line.
FieldTable read_field_table(const std::string& path);

}  // namespace lodestone

#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "core/magnetometer/magnetic_map.h"
#include "frontends/configuration/platform.h"

namespace lodestone {

struct FieldImportOptions {
  std::optional<FieldUnit> unit;   ///< else what the header names, else told from the field's size
  std::optional<double> height_m;  ///< of the whole map; needed where the table has no heights, refused where it has
  double sigma_ut = 1.0;           ///< of every node, where the table has no sigma
};

struct ImportedField {
  MagneticMap map;
  FieldUnit unit = FieldUnit::microtesla;
  bool unit_from_size = false;
  bool has_sigma = false;        ///< whether the table has
  double median_ut = 0.0;        ///< of the field's magnitude
  std::int64_t nodes = 0;        ///< with field
  std::int64_t in_cells = 0;     ///< of them with three neighbours in a square: elsewhere there is no interpolation
  bool metres_in_doubt = false;  ///< nobody says that the positions are metres, and they look like millimetres
};

/// Makes a map of a table (field_table.h) whose positions are nodes of a regular grid with one distance along x and y,
/// in any order of lines, at one height or several. Nodes without a line are without field.
///
/// Throws InputError, naming the file, where a line cannot be read, the positions are scattered (then `map magnetic` is
/// the way), the distances along x and y differ, two lines have one place, or the field's size is that of no unit.
ImportedField import_field_table(const std::string& path, const FieldImportOptions& options);

}  // namespace lodestone

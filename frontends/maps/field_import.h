#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "core/magnetometer/magnetic_map.h"
#include "frontends/configuration/platform.h"

namespace lodestone {

struct FieldImportOptions {
  std::optional<FieldUnit> unit;   ///< otherwise from the header, or detected from the field's magnitude
  std::optional<double> height_m;  ///< of the whole map; required if the table has no heights, otherwise refused
  double sigma_ut = 1.0;           ///< of every node, if the table has no sigma
};

struct ImportedField {
  MagneticMap map;
  FieldUnit unit = FieldUnit::microtesla;
  bool unit_from_size = false;
  bool has_sigma = false;        ///< whether the table has sigma
  double median_ut = 0.0;        ///< of the field's magnitude
  std::int64_t nodes = 0;        ///< with field
  std::int64_t in_cells = 0;     ///< nodes with three neighbours in a square, as interpolation requires
  bool metres_in_doubt = false;  ///< the unit of positions is not stated, and they look like millimetres
};

/// Builds a map from a table (field_table.h) with positions on a regular grid, equally spaced along x and y, in any
/// order of lines, at one or several heights. Nodes without a line have no field.
///
/// Throws InputError with the file's name if a line cannot be read, the positions are scattered (use `map magnetic`),
/// the spacings along x and y differ, two lines have the same position, or the field's magnitude fits no unit.
ImportedField import_field_table(const std::string& path, const FieldImportOptions& options);

}  // namespace lodestone

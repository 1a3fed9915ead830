#pragma once

#include <vector>

#include "core/magnetometer/magnetic_map.h"

namespace lodestone::figures {

/// Values on a regular grid of the map's floor plan: node (column i, row j) at (x_m, y_m) + resolution_m * (i, j).
struct Raster {
  double resolution_m = 0.1;
  double x_m = 0.0;
  double y_m = 0.0;
  int columns = 0;
  int rows = 0;
  std::vector<float> values;  ///< row by row from y_m on; NaN: none

  double x_high() const { return x_m + resolution_m * (columns - 1); }
  double y_high() const { return y_m + resolution_m * (rows - 1); }

  /// Bilinear between the four nodes round (x, y); NaN off the grid or at a node without value.
  double at(double x, double y) const;

  /// The value that a share (0 to 1) of the values does not exceed; NaN where there is none.
  double quantile(double share) const;
};

/// |B|, µT, at the map's nodes, at height `height_m`.
Raster strength_raster(const MagneticMap& map, double height_m);

/// |B_reference − B_other|, µT, at the nodes of `other`, at height `height_m`; NaN where one of them has no field.
Raster difference_raster(const MagneticMap& reference, const MagneticMap& other, double height_m);

}  // namespace lodestone::figures

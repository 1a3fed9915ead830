#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/magnetometer/magnetic_map.h"
#include "tools/report/cloud_thinning.h"

namespace lodestone {

/// |B| at one height on a regular raster, to look at. Value (column i, row j) lies at origin + resolution * (i, j).
struct FieldRaster {
  double resolution_m = 0.1;
  double x_m = 0.0;  ///< map x of column 0
  double y_m = 0.0;  ///< map y of row 0
  double height_m = 0.0;
  int columns = 0;
  int rows = 0;
  std::vector<float> strength_ut;  ///< row by row, µT; NaN where the map has no field

  bool empty() const { return strength_ut.empty(); }
};

/// Samples the map at `height_m` within `box`, at the map's own resolution or as coarse as `limit` values need. Empty where
/// box and map do not meet.
FieldRaster rasterize(const MagneticMap& map, const PlanBox& box, double height_m, std::size_t limit);

/// At most `limit` values: means of neighbours, where more came.
FieldRaster coarsened(const FieldRaster& raster, std::size_t limit);

/// Writes the raster as a 16-bit grey PNG, the row of the largest y first, and beside it `path` with .json: resolution_m,
/// origin_m, height_m, and the µT of one grey step; grey 0 is no field. Throws InputError.
void write_raster(const FieldRaster& raster, const std::filesystem::path& path);

/// Reads both, to within half a grey step. Throws InputError where they are missing or malformed.
FieldRaster read_raster(const std::filesystem::path& path);

/// A raster as a page shows it: an 8-bit grey PNG in which 0 is no field, 1 stands for `low_ut` and 255 for `high_ut` (the
/// 1 % and 99 % quantiles: a single bolt must not take the whole scale).
struct RasterImage {
  std::string png;
  double low_ut = 0.0;
  double high_ut = 1.0;
};
RasterImage to_image(const FieldRaster& raster);

}  // namespace lodestone

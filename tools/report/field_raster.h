#pragma once

#include <filesystem>
#include <string>

#include "tools/plotting/plan_raster.h"

namespace lodestone {

/// Writes |B| (µT) as a 16-bit grey PNG, the row of the largest y first, and beside it `path` with .json: resolution_m,
/// origin_m, height_m, and the µT of one grey step; grey 0 is no field. Throws InputError.
void write_raster(const PlanRaster& strength, const std::filesystem::path& path);

/// Reads both, to within half a grey step. Throws InputError where they are missing or malformed.
PlanRaster read_raster(const std::filesystem::path& path);

/// A raster as a page shows it: an 8-bit grey PNG in which 0 is no field, 1 stands for `low_ut` and 255 for `high_ut`
/// (the 1 % and 99 % quantiles: a single bolt must not take the whole scale).
struct RasterImage {
  std::string png;
  double low_ut = 0.0;
  double high_ut = 1.0;
};
RasterImage to_image(const PlanRaster& strength);

}  // namespace lodestone

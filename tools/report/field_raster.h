#pragma once

#include <filesystem>
#include <string>

#include "tools/plotting/plan_raster.h"

namespace lodestone {

/// Writes |B| (µT) as a 16-bit grey PNG, the first row with the largest y, and a JSON file of the same name:
/// resolution_m, origin_m, height_m, and the µT of one grey step. Grey 0 is no field. Throws InputError.
void write_raster(const PlanRaster& strength, const std::filesystem::path& path);

/// Reads both files, accurate to half a grey step. Throws InputError if they are missing or malformed.
PlanRaster read_raster(const std::filesystem::path& path);

/// A raster for the page: an 8-bit grey PNG; 0 is no field, 1 is `low_ut` and 255 is `high_ut` (the 1 % and 99 %
/// quantiles, so that single strong nodes do not dominate the scale).
struct RasterImage {
  std::string png;
  double low_ut = 0.0;
  double high_ut = 1.0;
};
RasterImage to_image(const PlanRaster& strength);

}  // namespace lodestone

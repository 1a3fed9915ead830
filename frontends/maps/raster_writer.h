#pragma once

#include <filesystem>
#include <functional>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "frontends/maps/raster_layout.h"

namespace lodestone {

/// Fills `values` (window size, initially NaN) with the pixels of a page. Returns false if all are NaN.
using RasterFill = std::function<bool(int page, const cv::Rect& window, cv::Mat1f& values)>;

/// Writes a TIFF of float32 pages in deflated tiles of `tile` pixels per side (a multiple of 16): an empty tile has
/// some hundred bytes, and tiles can be read separately. The file has a georeference in metres (GeoTIFF scale and tie
/// point, no projection) and NaN as "no data" value for QGIS. `fill` is called for each tile, page by page; one tile is
/// in memory. Written under a temporary name and renamed. Throws InputError with the file's name if this fails,
/// std::invalid_argument for a layout without pixels.
void write_raster(const std::filesystem::path& path, const RasterLayout& layout, int tile,
                  const std::vector<std::string>& page_names, const RasterFill& fill);

}  // namespace lodestone

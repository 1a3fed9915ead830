#pragma once

#include <filesystem>
#include <functional>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "frontends/maps/raster_layout.h"

namespace lodestone {

/// Fills `values`, of the window's size and NaN beforehand, with the pixels of a page. Returns false if all are NaN.
using RasterFill = std::function<bool(int page, const cv::Rect& window, cv::Mat1f& values)>;

/// Writes a TIFF of float32 pages in tiles of `tile` pixels a side (a multiple of 16), deflated: a tile of nothing but
/// NaN takes some hundred bytes, and readers need not read the others to get at one. It carries its place in metres
/// (GeoTIFF scale and tie point, no projection) and NaN as the value for "no data", so that QGIS lays it where it
/// belongs. `fill` is asked for each tile of each page, page by page; no more than one is in memory. Written aside,
/// then renamed. Throws InputError, naming the file, where that fails, std::invalid_argument for a layout without
/// pixels.
void write_raster(const std::filesystem::path& path, const RasterLayout& layout, int tile,
                  const std::vector<std::string>& page_names, const RasterFill& fill);

}  // namespace lodestone

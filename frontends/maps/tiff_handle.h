#pragma once

#include <memory>
#include <string>

struct tiff;

namespace lodestone {

/// An open TIFF of libtiff, closed with its holder.
struct TiffCloser {
  void operator()(tiff* file) const;
};
using TiffHandle = std::unique_ptr<tiff, TiffCloser>;

/// Opens with libtiff's `mode`; null where that fails. libtiff prints nothing: the user gets one line, ours. Tags that
/// place a raster (GeoTIFF's scale and tie point, GDAL's value for "no data") are known.
TiffHandle open_tiff(const std::string& path, const char* mode);

namespace tiff_tag {
constexpr unsigned model_pixel_scale = 33550;
constexpr unsigned model_tie_point = 33922;
constexpr unsigned no_data = 42113;
}  // namespace tiff_tag

}  // namespace lodestone

#pragma once

#include <memory>
#include <string>

struct tiff;

namespace lodestone {

/// An open TIFF of libtiff, closed by its owner.
struct TiffCloser {
  void operator()(tiff* file) const;
};
using TiffHandle = std::unique_ptr<tiff, TiffCloser>;

/// Opens with libtiff's `mode`; null if that fails. libtiff's own messages are suppressed. Registers the tags of
/// georeferences (GeoTIFF's scale and tie point, GDAL's "no data" value).
TiffHandle open_tiff(const std::string& path, const char* mode);

namespace tiff_tag {
constexpr unsigned model_pixel_scale = 33550;
constexpr unsigned model_tie_point = 33922;
constexpr unsigned no_data = 42113;
}  // namespace tiff_tag

}  // namespace lodestone

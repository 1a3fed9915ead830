#include "frontends/maps/raster_writer.h"

#include <tiffio.h>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <opencv2/core.hpp>
#include <stdexcept>

#include "core/error.h"
#include "frontends/configuration/aside.h"
#include "frontends/maps/tiff_handle.h"

namespace lodestone {
namespace {

constexpr float unwritten = std::numeric_limits<float>::quiet_NaN();

bool set_tags(TIFF* file, const RasterLayout& layout, int tile, int page, int pages, const std::string& name) {
  const double scale[3] = {layout.pixel_m, layout.pixel_m, 0.0};
  // The tie point is the upper left corner of the upper left pixel. The node is that pixel's centre.
  const double tie_point[6] = {0.0,
                               0.0,
                               0.0,
                               layout.origin.x() - 0.5 * layout.pixel_m,
                               layout.origin.y() + (layout.size.height - 0.5) * layout.pixel_m,
                               0.0};
  return TIFFSetField(file, TIFFTAG_IMAGEWIDTH, static_cast<std::uint32_t>(layout.size.width)) == 1 &&
         TIFFSetField(file, TIFFTAG_IMAGELENGTH, static_cast<std::uint32_t>(layout.size.height)) == 1 &&
         TIFFSetField(file, TIFFTAG_TILEWIDTH, static_cast<std::uint32_t>(tile)) == 1 &&
         TIFFSetField(file, TIFFTAG_TILELENGTH, static_cast<std::uint32_t>(tile)) == 1 &&
         TIFFSetField(file, TIFFTAG_BITSPERSAMPLE, 32) == 1 && TIFFSetField(file, TIFFTAG_SAMPLESPERPIXEL, 1) == 1 &&
         TIFFSetField(file, TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_IEEEFP) == 1 &&
         TIFFSetField(file, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK) == 1 &&
         TIFFSetField(file, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG) == 1 &&
         TIFFSetField(file, TIFFTAG_COMPRESSION, COMPRESSION_ADOBE_DEFLATE) == 1 &&
         TIFFSetField(file, TIFFTAG_PREDICTOR, PREDICTOR_NONE) == 1 &&
         TIFFSetField(file, TIFFTAG_PAGENUMBER, page, pages) == 1 &&
         TIFFSetField(file, TIFFTAG_PAGENAME, name.c_str()) == 1 &&
         TIFFSetField(file, tiff_tag::model_pixel_scale, 3, scale) == 1 &&
         TIFFSetField(file, tiff_tag::model_tie_point, 6, tie_point) == 1 &&
         TIFFSetField(file, tiff_tag::no_data, "nan") == 1;
}

bool write_page(TIFF* file, const RasterLayout& layout, int tile, int page, const RasterFill& fill) {
  for (int top = 0; top < layout.size.height; top += tile) {
    for (int left = 0; left < layout.size.width; left += tile) {
      const cv::Size size(std::min(tile, layout.size.width - left), std::min(tile, layout.size.height - top));
      cv::Mat1f values(size, unwritten);
      cv::Mat1f image(tile, tile, unwritten);
      if (fill(page, {{left, layout.size.height - top - size.height}, size}, values)) {
        cv::flip(values, image(cv::Rect({0, 0}, size)), 0);
      }
      const std::uint32_t index =
          TIFFComputeTile(file, static_cast<std::uint32_t>(left), static_cast<std::uint32_t>(top), 0, 0);
      const auto bytes = static_cast<tmsize_t>(image.total() * sizeof(float));
      if (TIFFWriteEncodedTile(file, index, image.data, bytes) < 0) return false;
    }
  }
  return TIFFWriteDirectory(file) == 1;
}

}  // namespace

void write_raster(const std::filesystem::path& path, const RasterLayout& layout, int tile,
                  const std::vector<std::string>& page_names, const RasterFill& fill) {
  if (layout.size.empty() || tile < 16 || tile % 16 != 0) {
    throw std::invalid_argument("write_raster: expected at least one pixel, and a tile size that is a multiple of 16");
  }
  const std::filesystem::path aside = aside_name(path.string());
  // Classic TIFF is limited to 4 GiB; deflate increases the size only slightly.
  const double bytes = 4.0 * layout.size.width * layout.size.height * static_cast<double>(page_names.size());
  const int pages = static_cast<int>(page_names.size());
  std::error_code code;
  bool good = false;
  try {
    TiffHandle file = open_tiff(aside.string(), bytes > 3.9e9 ? "w8" : "w");
    good = file != nullptr;
    for (int page = 0; good && page < pages; ++page) {
      good = set_tags(file.get(), layout, tile, page, pages, page_names[page]) &&
             write_page(file.get(), layout, tile, page, fill);
    }
  } catch (...) {
    std::filesystem::remove(aside, code);
    throw;
  }
  if (good) std::filesystem::rename(aside, path, code);
  if (!good || code) {
    std::filesystem::remove(aside, code);
    throw InputError(path.string() + ": cannot be written; check the folder and the free disk space");
  }
}

}  // namespace lodestone

#include "frontends/maps/tiff_handle.h"

#include <tiffio.h>

#include <mutex>

namespace lodestone {
namespace {

TIFFExtendProc next_extender = nullptr;

void add_tags(TIFF* file) {
  static char scale[] = "ModelPixelScale";
  static char tie_point[] = "ModelTiepoint";
  static char no_data[] = "GDALNoDataValue";
  static const TIFFFieldInfo tags[] = {{tiff_tag::model_pixel_scale, -1, -1, TIFF_DOUBLE, FIELD_CUSTOM, 1, 1, scale},
                                       {tiff_tag::model_tie_point, -1, -1, TIFF_DOUBLE, FIELD_CUSTOM, 1, 1, tie_point},
                                       {tiff_tag::no_data, -1, -1, TIFF_ASCII, FIELD_CUSTOM, 1, 0, no_data}};
  TIFFMergeFieldInfo(file, tags, sizeof(tags) / sizeof(tags[0]));
  if (next_extender != nullptr) next_extender(file);
}

}  // namespace

void TiffCloser::operator()(tiff* file) const {
  TIFFClose(file);
}

TiffHandle open_tiff(const std::string& path, const char* mode) {
  static std::once_flag once;
  std::call_once(once, [] { next_extender = TIFFSetTagExtender(add_tags); });
  // Set for every file: another library of the process may have changed the handler.
  TIFFSetErrorHandler(nullptr);
  TIFFSetWarningHandler(nullptr);
  return TiffHandle(TIFFOpen(path.c_str(), mode));
}

}  // namespace lodestone

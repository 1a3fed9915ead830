#include "tools/report/grey_png.h"

#include <png.h>

#include <stdexcept>

namespace lodestone {

namespace {

template <class Value>
std::string encode(const GreyImage<Value>& image, png_uint_32 format) {
  png_image description{};
  description.version = PNG_IMAGE_VERSION;
  description.width = static_cast<png_uint_32>(image.columns);
  description.height = static_cast<png_uint_32>(image.rows);
  description.format = format;
  png_alloc_size_t size = 0;
  std::string bytes;
  if (png_image_write_to_memory(&description, nullptr, &size, 0, image.values.data(), 0, nullptr) != 0) {
    bytes.resize(size);
    if (png_image_write_to_memory(&description, bytes.data(), &size, 0, image.values.data(), 0, nullptr) != 0) {
      bytes.resize(size);
      return bytes;
    }
  }
  throw std::runtime_error(std::string("libpng: ") + description.message);
}

}  // namespace

std::string encode_png(const GreyImage<std::uint16_t>& image) { return encode(image, PNG_FORMAT_LINEAR_Y); }
std::string encode_png(const GreyImage<std::uint8_t>& image) { return encode(image, PNG_FORMAT_GRAY); }

std::optional<GreyImage<std::uint16_t>> decode_png(const std::string& bytes) {
  png_image description{};
  description.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_memory(&description, bytes.data(), bytes.size()) == 0) return std::nullopt;
  if (description.format != PNG_FORMAT_LINEAR_Y) {
    png_image_free(&description);
    return std::nullopt;
  }
  GreyImage<std::uint16_t> image;
  image.columns = static_cast<int>(description.width);
  image.rows = static_cast<int>(description.height);
  image.values.resize(static_cast<std::size_t>(image.columns) * image.rows);
  if (png_image_finish_read(&description, nullptr, image.values.data(), 0, nullptr) == 0) return std::nullopt;
  return image;
}

}  // namespace lodestone

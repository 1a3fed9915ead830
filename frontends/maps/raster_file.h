#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <list>
#include <map>
#include <mutex>
#include <opencv2/core/mat.hpp>
#include <string>
#include <utility>
#include <vector>

#include "frontends/maps/raster_layout.h"
#include "frontends/maps/tiff_handle.h"

namespace lodestone {

/// A TIFF of float32 pages of equal size, in tiles or strips, read on demand. Memory: the most recently decoded tiles,
/// up to a limit. The number of open handles does not depend on the number of pages.
class RasterFile {
 public:
  /// `cache_bytes`: limit of cached decoded tiles; neighbouring windows share tiles.
  /// Throws InputError with the file's name if the file is missing, not a TIFF, cut off, has other pages, or announces
  /// more or larger tiles than its bytes can contain.
  explicit RasterFile(std::string path, std::size_t cache_bytes = 16U << 20U);

  cv::Size size() const { return size_; }  ///< columns, rows
  int pages() const { return static_cast<int>(pages_.size()); }

  /// The pixels of a window within the raster, rows from below. Thread-safe. Throws InputError if the file is no longer
  /// readable.
  cv::Mat1f read(int page, const cv::Rect& window) const;

 private:
  using BlockKey = std::pair<int, std::uint32_t>;  ///< page, tile
  /// One page.
  struct Page {
    std::uint64_t offset = 0;  ///< of the page's description in the file
    cv::Size block;            ///< pixels of one tile, or strip
    bool tiled = false;
  };
  /// An open file, positioned at one page.
  struct Handle {
    TiffHandle file;
    int page = -1;
  };
  void describe(int page, tiff* file, std::uint64_t size);
  Page describe_blocks(int page, tiff* file, std::uint64_t size);
  tiff* file_at(int page) const;
  cv::Mat1f block(int page, std::uint32_t index) const;

  std::string path_;
  std::size_t cache_bytes_;
  cv::Size size_;
  std::vector<Page> pages_;
  std::uint64_t blocks_ = 0;  ///< tiles of all pages
  mutable std::mutex mutex_;
  /// libtiff reads a page's description each time it moves to the page, and a query alternates between the eight pages
  /// of two neighbouring layers. Therefore page n is read through handle n mod 16. All handles are opened at once, so
  /// that they refer to the same file even if it is replaced later.
  mutable std::array<Handle, 16> handles_;
  mutable std::size_t cached_bytes_ = 0;
  mutable std::list<std::pair<BlockKey, cv::Mat1f>> cache_;  ///< most recently used in front
  mutable std::map<BlockKey, std::list<std::pair<BlockKey, cv::Mat1f>>::iterator> cached_;
};

}  // namespace lodestone

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

/// A TIFF of float32 pages of one size, in tiles or in strips, read piece by piece. Memory: what was decoded last, up
/// to a bound. The file is open a few times, however many pages it has.
class RasterFile {
 public:
  /// `cache_bytes`: most of the decoded tiles to keep, since neighbouring windows share them.
  /// Throws InputError, naming the file, where it is missing, no TIFF, cut off, not of such pages, or announces more
  /// tiles, or larger ones, than its bytes can hold.
  explicit RasterFile(std::string path, std::size_t cache_bytes = 16U << 20U);

  cv::Size size() const { return size_; }  ///< columns, rows
  int pages() const { return static_cast<int>(pages_.size()); }

  /// The pixels of a window within the raster, rows from below. Thread-safe. Throws InputError if the file cannot be
  /// read any more.
  cv::Mat1f read(int page, const cv::Rect& window) const;

 private:
  using BlockKey = std::pair<int, std::uint32_t>;  ///< page, tile
  /// Of one page.
  struct Page {
    std::uint64_t offset = 0;  ///< of its description in the file
    cv::Size block;            ///< pixels of one tile, or strip
    bool tiled = false;
  };
  /// An open file, which is at one page at a time.
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
  /// libtiff reads a page's whole description anew when it comes to it, and a query asks for the eight pages of two
  /// neighbouring layers in turn: page n is read through handle n mod 16. All are opened at the start, so that they are
  /// of one file, whatever replaces it later.
  mutable std::array<Handle, 16> handles_;
  mutable std::size_t cached_bytes_ = 0;
  mutable std::list<std::pair<BlockKey, cv::Mat1f>> cache_;  ///< the last used in front
  mutable std::map<BlockKey, std::list<std::pair<BlockKey, cv::Mat1f>>::iterator> cached_;
};

}  // namespace lodestone

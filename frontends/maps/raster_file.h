#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "frontends/maps/raster_layout.h"
#include "frontends/maps/tiff_handle.h"

namespace lodestone {

/// A TIFF of float32 pages of one size, in tiles or in strips, read piece by piece. Memory: what was decoded last, up to
/// a bound. The file is open a few times, however many pages it has.
class RasterFile {
 public:
  /// `cache_bytes`: most of the decoded tiles to keep, since neighbouring windows share them.
  /// Throws InputError, naming the file, where it is missing, no TIFF, cut off, not of such pages, or announces more tiles, or larger
  /// ones, than its bytes can hold.
  explicit RasterFile(std::string path, std::size_t cache_bytes = 16U << 20U);

  int columns() const { return columns_; }
  int rows() const { return rows_; }
  int pages() const { return static_cast<int>(pages_.size()); }

  /// The pixels of a window that lies within the raster, row by row from below, into `values`. Thread-safe. Throws
  /// InputError where the file cannot be read any more.
  void read(int page, const RasterWindow& window, float* values) const;

 private:
  using Block = std::shared_ptr<const std::vector<float>>;  ///< null: the file has no such tile
  using BlockKey = std::pair<int, std::uint32_t>;           ///< page, tile
  /// Of one page.
  struct Page {
    std::uint64_t offset = 0;  ///< of its description in the file
    int columns = 0;           ///< pixels of one tile, or strip
    int rows = 0;
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
  Block block(int page, std::uint32_t index) const;

  std::string path_;
  std::size_t cache_bytes_;
  int columns_ = 0;
  int rows_ = 0;
  std::vector<Page> pages_;
  std::uint64_t blocks_ = 0;  ///< tiles of all pages
  mutable std::mutex mutex_;
  /// libtiff reads a page's whole description anew when it comes to it, and a query asks for the eight pages of two neighbouring
  /// layers in turn: page n is read through handle n mod 16. All are opened at the start, so that they are of one file, whatever
  /// replaces it later.
  mutable std::array<Handle, 16> handles_;
  mutable std::size_t cached_bytes_ = 0;
  mutable std::list<std::pair<BlockKey, Block>> cache_;  ///< the last used in front
  mutable std::map<BlockKey, std::list<std::pair<BlockKey, Block>>::iterator> cached_;
};

}  // namespace lodestone

#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "frontends/rasters/raster_layout.h"
#include "frontends/rasters/tiff_handle.h"

namespace lodestone {

/// A TIFF of float32 pages of one size, in tiles or in strips, read piece by piece. Memory: what was decoded last, up to
/// a bound.
class RasterFile {
 public:
  /// `cache_bytes`: most of the decoded tiles to keep, since neighbouring windows share them.
  /// Throws InputError, naming the file, where it is missing, no TIFF, cut off, or not of such pages.
  explicit RasterFile(std::string path, std::size_t cache_bytes = 16U << 20U);

  int columns() const { return columns_; }
  int rows() const { return rows_; }
  int pages() const { return static_cast<int>(files_.size()); }

  /// The pixels of a window that lies within the raster, row by row from below, into `values`. Thread-safe. Throws
  /// InputError where the file cannot be read any more.
  void read(int page, const RasterWindow& window, float* values) const;

 private:
  using Block = std::shared_ptr<const std::vector<float>>;
  using BlockKey = std::pair<int, std::uint32_t>;  ///< page, tile
  void open(int page);
  Block block(int page, std::uint32_t index) const;

  std::string path_;
  std::size_t cache_bytes_;
  std::vector<TiffHandle> files_;  ///< one a page: libtiff reads the whole directory anew when it changes pages
  int columns_ = 0;
  int rows_ = 0;
  struct Blocks {
    int columns = 0;  ///< pixels of one tile, or strip
    int rows = 0;
    bool tiled = false;
  };
  std::vector<Blocks> blocks_;  ///< a page
  mutable std::mutex mutex_;
  mutable std::size_t cached_bytes_ = 0;
  mutable std::list<std::pair<BlockKey, Block>> cache_;  ///< the last used in front
  mutable std::map<BlockKey, std::list<std::pair<BlockKey, Block>>::iterator> cached_;
};

}  // namespace lodestone

#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "core/magnetometer/field_tile.h"

namespace lodestone {

/// The tiles of one magnetic map: all of them in memory, or those that were asked for last. Tiles without field take no
/// memory. Thread-safe; what is found never depends on what is in memory.
class FieldTileCache {
 public:
  /// All tiles, made at once.
  FieldTileCache(const FieldGrid& grid, const FieldNodes& nodes);

  /// Tiles of up to `max_bytes` in memory (never fewer than 16 tiles), made when a query comes to them.
  FieldTileCache(const FieldGrid& grid, std::shared_ptr<const FieldNodes> nodes, std::size_t max_bytes);

  int columns() const { return columns_; }  ///< of tiles
  int rows() const { return rows_; }

  /// The tile at (row, column) of the tiles; null where it has no field. Holds until this thread asks for another tile.
  /// Throws what the source of the nodes throws.
  const FieldTile* find(int layer, int row, int column) const;

  std::int64_t loads() const;               ///< tiles with field that were made so far
  std::size_t most_resident_bytes() const;  ///< the most that were in memory at once

 private:
  std::shared_ptr<const FieldTile> load(std::int64_t index, int layer, int row, int column) const;
  std::int64_t index_of(int layer, int row, int column) const {
    return (static_cast<std::int64_t>(layer) * rows_ + row) * columns_ + column;
  }

  FieldGrid grid_;
  int columns_;
  int rows_;
  std::vector<std::unique_ptr<const FieldTile>> whole_;  ///< empty for a map that comes and goes

  using Entry = std::pair<std::int64_t, std::shared_ptr<const FieldTile>>;
  std::shared_ptr<const FieldNodes> nodes_;
  std::size_t max_tiles_ = 0;
  std::uint64_t serial_ = 0;  ///< tells the caches of a process apart
  mutable std::mutex mutex_;
  mutable std::list<Entry> used_;  ///< the last used in front
  mutable std::unordered_map<std::int64_t, std::list<Entry>::iterator> resident_;
  /// Tiles known to have no field. A set: a file announces a larger grid than anyone asks for, in next to no bytes.
  mutable std::unordered_set<std::int64_t> empty_;
  mutable std::int64_t loads_ = 0;
  mutable std::size_t most_resident_ = 0;
};

}  // namespace lodestone

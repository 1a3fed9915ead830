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

/// The tiles of one magnetic map: all of them, or the last used, in memory. Tiles without field take no memory.
/// Thread-safe; results do not depend on which tiles are in memory.
class FieldTileCache {
 public:
  /// All tiles, computed at once.
  FieldTileCache(const FieldGrid& grid, const FieldNodes& nodes);

  /// Tiles of up to `max_bytes` in memory (never fewer than 16 tiles), loaded on demand.
  FieldTileCache(const FieldGrid& grid, std::shared_ptr<const FieldNodes> nodes, std::size_t max_bytes);

  int columns() const { return columns_; }  ///< of tiles
  int rows() const { return rows_; }

  /// The tile at (row, column) of the tiles; null if it has no field. Valid until this thread asks for another tile.
  /// Throws the exceptions of the source of the nodes.
  const FieldTile* find(int layer, int row, int column) const;

  std::int64_t loads() const;               ///< tiles with field that were loaded so far
  std::size_t most_resident_bytes() const;  ///< the most that were in memory at any time

 private:
  std::shared_ptr<const FieldTile> load(std::int64_t index, int layer, int row, int column) const;
  std::int64_t index_of(int layer, int row, int column) const {
    return (static_cast<std::int64_t>(layer) * rows_ + row) * columns_ + column;
  }

  FieldGrid grid_;
  int columns_;
  int rows_;
  std::vector<std::unique_ptr<const FieldTile>> whole_;  ///< empty for a map that loads tiles on demand

  using Entry = std::pair<std::int64_t, std::shared_ptr<const FieldTile>>;
  std::shared_ptr<const FieldNodes> nodes_;
  std::size_t max_tiles_ = 0;
  std::uint64_t serial_ = 0;  ///< distinguishes the caches of a process
  mutable std::mutex mutex_;
  mutable std::list<Entry> used_;  ///< the last used first
  mutable std::unordered_map<std::int64_t, std::list<Entry>::iterator> resident_;
  /// Tiles known to have no field. A set: a file may state a huge grid in a few bytes.
  mutable std::unordered_set<std::int64_t> empty_;
  mutable std::int64_t loads_ = 0;
  mutable std::size_t most_resident_ = 0;
};

}  // namespace lodestone

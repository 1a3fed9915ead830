#include "core/magnetometer/field_tile_cache.h"

#include <algorithm>
#include <array>
#include <atomic>

namespace lodestone {
namespace {

/// The last tiles of a thread. Neighbouring tiles have different slots, so that a robot at a corner of four tiles, or
/// between two layers, finds all of them without a lock.
struct Remembered {
  std::uint64_t serial = 0;
  std::int64_t index = -1;
  std::shared_ptr<const FieldTile> tile;
};
thread_local std::array<Remembered, 8> remembered;

std::atomic<std::uint64_t> next_serial{1};

int tiles_along(int nodes) {
  return std::max(1, (nodes - 1 + FieldTile::cells - 1) / FieldTile::cells);
}

}  // namespace

FieldTileCache::FieldTileCache(const FieldGrid& grid, const FieldNodes& nodes)
    : grid_(grid), columns_(tiles_along(grid.columns)), rows_(tiles_along(grid.rows)) {
  const int layers = static_cast<int>(grid.heights_m.size());
  whole_.reserve(static_cast<std::size_t>(layers) * rows_ * columns_);
  for (int layer = 0; layer < layers; ++layer) {
    for (int row = 0; row < rows_; ++row) {
      for (int column = 0; column < columns_; ++column) {
        whole_.push_back(FieldTile::make(grid, nodes, layer, row * FieldTile::cells, column * FieldTile::cells));
        loads_ += whole_.back() != nullptr;
      }
    }
  }
  most_resident_ = static_cast<std::size_t>(loads_);
}

FieldTileCache::FieldTileCache(const FieldGrid& grid, std::shared_ptr<const FieldNodes> nodes, std::size_t max_bytes)
    : grid_(grid),
      columns_(tiles_along(grid.columns)),
      rows_(tiles_along(grid.rows)),
      nodes_(std::move(nodes)),
      max_tiles_(std::max<std::size_t>(16, max_bytes / FieldTile::bytes())),
      serial_(next_serial++) {}

const FieldTile* FieldTileCache::find(int layer, int row, int column) const {
  const std::int64_t index = index_of(layer, row, column);
  if (!nodes_) return whole_[static_cast<std::size_t>(index)].get();
  Remembered& place = remembered[static_cast<std::size_t>((layer & 1) * 4 + (row & 1) * 2 + (column & 1))];
  if (place.serial != serial_ || place.index != index) {
    place.tile = load(index, layer, row, column);
    place.serial = serial_;
    place.index = index;
  }
  return place.tile.get();
}

std::shared_ptr<const FieldTile> FieldTileCache::load(std::int64_t index, int layer, int row, int column) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (empty_.contains(index)) return nullptr;
  if (const auto found = resident_.find(index); found != resident_.end()) {
    used_.splice(used_.begin(), used_, found->second);
    return found->second->second;
  }
  std::shared_ptr<const FieldTile> tile =
      FieldTile::make(grid_, *nodes_, layer, row * FieldTile::cells, column * FieldTile::cells);
  if (!tile) {
    empty_.insert(index);
    return nullptr;
  }
  if (resident_.size() >= max_tiles_) {
    resident_.erase(used_.back().first);
    used_.pop_back();
  }
  used_.emplace_front(index, tile);
  resident_[index] = used_.begin();
  ++loads_;
  most_resident_ = std::max(most_resident_, resident_.size());
  return tile;
}

std::int64_t FieldTileCache::loads() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return loads_;
}

std::size_t FieldTileCache::most_resident_bytes() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return most_resident_ * FieldTile::bytes();
}

}  // namespace lodestone

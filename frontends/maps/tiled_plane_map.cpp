#include "frontends/maps/tiled_plane_map.h"

#include <algorithm>
#include <cmath>

#include "core/lidar/plane_thickness.h"
#include "core/thread_limit.h"

namespace lodestone {

namespace {

int floor_divide(int value, int divisor) {
  return value >= 0 ? value / divisor : -((-value + divisor - 1) / divisor);
}

/// Distance from a point to the nearest point of a tile.
double distance_to_tile(const Eigen::Vector2d& point, const TileIndex& tile, double tile_m) {
  const Eigen::Vector2d low(tile.first * tile_m, tile.second * tile_m);
  const Eigen::Vector2d high = low.array() + tile_m;
  return (point - point.cwiseMax(low).cwiseMin(high)).norm();
}

}  // namespace

TiledPlaneMap::TiledPlaneMap(Content content, double reach_m)
    : content_(std::move(content)), reach_m_(reach_m), moves_m_(0.5 * tile_m()) {}

std::shared_ptr<const PlaneMap> TiledPlaneMap::around(const Vector3& position) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  const Eigen::Vector2d place = position.head<2>();
  for (auto residence = residences_.rbegin(); residence != residences_.rend(); ++residence) {
    if (!((place - residence->center).norm() <= moves_m_)) continue;
    if (auto map = residence->map.lock()) {
      if (map == newest_) load_ahead(place);
      return map;
    }
  }
  newest_.reset();  // frees the old tiles, unless in use, before the new ones are loaded
  std::erase_if(residences_, [](const Residence& residence) { return residence.map.expired(); });
  const bool is_ahead = ahead_.valid() && (place - ahead_center_).norm() <= moves_m_;
  if (ahead_.valid()) newest_ = ahead_.get();
  if (!is_ahead) {
    newest_.reset();
    newest_ = load(place);
  }
  residences_.push_back({is_ahead ? ahead_center_ : place, newest_});
  ++loads_;
  return newest_;
}

/// Begins to load tiles before the robot leaves the newest ones, around the place where it will leave them. Look-ups
/// give the same bits with the tiles around any such place.
void TiledPlaneMap::load_ahead(const Eigen::Vector2d& place) const {
  constexpr double kBegin = 0.75;  // of the way to the next loading: a second for a robot with 4 m/s and usual tiles
  const Eigen::Vector2d moved = place - residences_.back().center;
  if (moved.norm() < kBegin * moves_m_ || ahead_.valid() || usable_threads() == 1) return;
  ahead_center_ = residences_.back().center + moves_m_ * moved.normalized();
  ahead_ = std::async(std::launch::async, [this, center = ahead_center_] { return load(center); });
}

std::int64_t TiledPlaneMap::loads() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return loads_;
}

std::shared_ptr<const PlaneMap> TiledPlaneMap::load(const Eigen::Vector2d& center) const {
  std::vector<TilePiece> pieces;
  std::size_t count = 0;
  for (const auto& [tile, piece] : content_.tiles) {
    if (!(distance_to_tile(center, tile, tile_m()) <= resident_radius_m())) continue;
    pieces.push_back(piece);
    count += static_cast<std::size_t>(piece.count);
  }
  std::vector<VoxelPlane> voxels(count);
  VoxelPlane* next = voxels.data();
  for (const TilePiece& piece : pieces) {
    content_.spool->read(piece.offset, next, static_cast<std::size_t>(piece.count) * sizeof(VoxelPlane));
    next += piece.count;
  }
  return std::make_shared<PlaneMap>(voxels, content_.thickness, content_.options);
}

void TiledPlaneMap::Content::for_each_voxel(const VoxelPlaneVisitor& visit) const {
  for (const auto& [tile, piece] : tiles) {
    std::vector<VoxelPlane> voxels(static_cast<std::size_t>(piece.count));
    spool->read(piece.offset, voxels.data(), voxels.size() * sizeof(VoxelPlane));
    std::for_each(voxels.begin(), voxels.end(), visit);
  }
}

void TiledPlaneMap::for_each_voxel(const VoxelVisitor& visit) const {
  const PlaneLimits limits(content_.thickness, content_.options);
  content_.for_each_voxel([&](const VoxelPlane& voxel) {
    const Plane plane = with_shared_thickness(voxel.plane, content_.thickness);
    visit(voxel_of_key(voxel.key), limits.allow(voxel) ? &plane : nullptr);
  });
}

TiledPlaneMapBuilder::TiledPlaneMapBuilder(const PlaneMapOptions& options, const std::string& folder,
                                           std::size_t buffer_bytes)
    : options_(options),
      membership_(options),
      folder_(folder),
      tile_voxels_(std::max(1, static_cast<int>(std::lround(options.tile_m / options.voxel_m)))),
      most_waiting_(std::max<std::size_t>(1, buffer_bytes / sizeof(Eigen::Vector3f))),
      spool_(std::make_unique<SpoolFile>(folder)) {}

void TiledPlaneMapBuilder::add(std::span<const Eigen::Vector3f> points) {
  TileIndex last{};
  PointTile* tile = nullptr;  // neighbours in the file are mostly in the same tile
  for (const Eigen::Vector3f& point : points) {
    const VoxelRange range = membership_.of(point);
    // A point near an edge belongs to the voxels, and so to the tiles, on both sides.
    for (int x = floor_divide(range.low.x(), tile_voxels_); x <= floor_divide(range.high.x(), tile_voxels_); ++x) {
      for (int y = floor_divide(range.low.y(), tile_voxels_); y <= floor_divide(range.high.y(), tile_voxels_); ++y) {
        if (tile == nullptr || last != TileIndex(x, y)) {
          last = {x, y};
          tile = &tiles_[last];
        }
        tile->waiting.push_back(point);
        ++waiting_;
      }
    }
    if (waiting_ >= most_waiting_) flush();
  }
}

void TiledPlaneMapBuilder::flush() {
  for (auto& [index, tile] : tiles_) {
    if (tile.waiting.empty()) continue;
    const std::int64_t offset = spool_->append(tile.waiting.data(), tile.waiting.size() * sizeof(Eigen::Vector3f));
    tile.pieces.push_back({offset, static_cast<std::int64_t>(tile.waiting.size())});
    std::vector<Eigen::Vector3f>().swap(tile.waiting);
  }
  waiting_ = 0;
}

std::vector<Eigen::Vector3f> TiledPlaneMapBuilder::points_of(const PointTile& tile) const {
  std::size_t count = 0;
  for (const TilePiece& piece : tile.pieces) count += static_cast<std::size_t>(piece.count);
  std::vector<Eigen::Vector3f> points(count);
  Eigen::Vector3f* next = points.data();
  for (const TilePiece& piece : tile.pieces) {
    spool_->read(piece.offset, next, static_cast<std::size_t>(piece.count) * sizeof(Eigen::Vector3f));
    next += piece.count;
  }
  return points;
}

std::shared_ptr<const TiledPlaneMap> TiledPlaneMapBuilder::build(double reach_m) {
  flush();
  TiledPlaneMap::Content content;
  content.options = options_;
  content.tile_voxels = tile_voxels_;
  content.spool = std::make_unique<SpoolFile>(folder_);
  for (const auto& [index, tile] : tiles_) {
    const auto within = [&, &index = index](const Eigen::Vector3i& voxel) {
      return floor_divide(voxel.x(), tile_voxels_) == index.first &&
             floor_divide(voxel.y(), tile_voxels_) == index.second;
    };
    const std::vector<VoxelPlane> voxels = fit_voxel_planes(points_of(tile), options_, within);
    const std::int64_t offset = content.spool->append(voxels.data(), voxels.size() * sizeof(VoxelPlane));
    content.tiles[index] = {offset, static_cast<std::int64_t>(voxels.size())};
  }
  tiles_.clear();
  spool_.reset();
  // Thickness is relative to the whole map, as without tiles.
  content.thickness =
      thickness_of([&content](const VoxelPlaneVisitor& visit) { content.for_each_voxel(visit); }, options_);
  const PlaneLimits limits(content.thickness, options_);
  content.for_each_voxel([&](const VoxelPlane& voxel) { content.planes += limits.allow(voxel) ? 1 : 0; });
  return std::make_shared<TiledPlaneMap>(std::move(content), reach_m);
}

}  // namespace lodestone

#pragma once

#include <cstdint>
#include <future>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "core/lidar/plane_map.h"
#include "frontends/maps/spool_file.h"

namespace lodestone {

/// Column and row of a tile: a square column of voxels, unlimited in height.
using TileIndex = std::pair<int, int>;

/// Position of a piece of a tile in a spool file; pieces are in order.
struct TilePiece {
  std::int64_t offset;
  std::int64_t count;
};

/// A map larger than memory: planes are on disk in tiles; tiles around the robot are in memory. Tiles are loaded only
/// if the robot has moved by half a tile since the last loading; shortly before, a thread of its own begins to load
/// them where the robot will be then, unless ThreadLimit allows one thread only. Earlier tiles stay as long as a user
/// has a reference, and are reused, so that a smoother with a window across tiles does not reload them repeatedly.
class TiledPlaneMap final : public PlaneMapSource {
 public:
  /// Tiles with all fitted planes.
  struct Content {
    void for_each_voxel(const VoxelPlaneVisitor& visit) const;

    PlaneMapOptions options;
    int tile_voxels = 0;
    std::unique_ptr<SpoolFile> spool;  ///< of VoxelPlane
    std::map<TileIndex, TilePiece> tiles;
    PlaneThickness thickness;
    std::int64_t planes = 0;  ///< of the whole map
  };

  /// `reach_m`: largest distance of required planes from the position of `around`.
  TiledPlaneMap(Content content, double reach_m);

  /// Thread-safe. Throws InputError if the disk fails.
  std::shared_ptr<const PlaneMap> around(const Vector3& position) const override;

  double voxel_m() const override { return content_.options.voxel_m; }
  void for_each_voxel(const VoxelVisitor& visit) const override;

  std::int64_t planes() const { return content_.planes; }
  std::size_t tiles() const { return content_.tiles.size(); }
  double tile_m() const { return content_.tile_voxels * content_.options.voxel_m; }
  double resident_radius_m() const { return reach_m_ + moves_m_; }

  /// Number of loadings so far.
  std::int64_t loads() const;

 private:
  struct Residence {
    Eigen::Vector2d center;
    std::weak_ptr<const PlaneMap> map;
  };
  std::shared_ptr<const PlaneMap> load(const Eigen::Vector2d& center) const;
  void load_ahead(const Eigen::Vector2d& place) const;

  Content content_;
  double reach_m_;
  double moves_m_;  ///< distance from the centre of the loaded tiles that triggers loading
  mutable std::mutex mutex_;
  mutable std::shared_ptr<const PlaneMap> newest_;  ///< keeps the newest tiles between queries
  mutable std::vector<Residence> residences_;
  mutable std::int64_t loads_ = 0;
  mutable Eigen::Vector2d ahead_center_ = Eigen::Vector2d::Zero();
  mutable std::future<std::shared_ptr<const PlaneMap>> ahead_;  ///< the next tiles; its destructor waits for the thread
};

/// Divides a cloud of any size into tiles and fits their planes. Memory: `buffer_bytes` of points while adding, then
/// one tile's points.
class TiledPlaneMapBuilder {
 public:
  /// `folder`: for temporary files. Throws InputError if they cannot be created.
  TiledPlaneMapBuilder(const PlaneMapOptions& options, const std::string& folder,
                       std::size_t buffer_bytes = 64U << 20U);

  /// The next points of the cloud (map frame, metres; finite), in its order.
  void add(std::span<const Eigen::Vector3f> points);

  /// Fits all tiles and returns the map. No points can be added afterwards.
  std::shared_ptr<const TiledPlaneMap> build(double reach_m);

 private:
  struct PointTile {
    std::vector<Eigen::Vector3f> waiting;
    std::vector<TilePiece> pieces;
  };
  void flush();
  std::vector<Eigen::Vector3f> points_of(const PointTile& tile) const;

  PlaneMapOptions options_;
  VoxelMembership membership_;
  std::string folder_;
  int tile_voxels_;
  std::size_t most_waiting_;
  std::size_t waiting_ = 0;
  std::unique_ptr<SpoolFile> spool_;  ///< of points
  std::map<TileIndex, PointTile> tiles_;
};

}  // namespace lodestone

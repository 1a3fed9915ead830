#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "core/lidar/plane_map.h"
#include "frontends/maps/spool_file.h"

namespace lodestone {

/// Column and row of a tile: a square column of voxels, unlimited upwards and downwards.
using TileIndex = std::pair<int, int>;

/// Where pieces of a tile lie in a spool, in order.
struct TilePiece {
  std::int64_t offset;
  std::int64_t count;
};

/// A map larger than memory: its planes lie on disk, tile by tile; those of the tiles round the robot are in memory.
/// Tiles are loaded anew when the robot has moved by half a tile from where they last were, and only then. Memory holds
/// the planes of one such circle, and those of earlier ones for as long as a user holds them; until then they serve,
/// too, so that a smoother whose window reaches back over a tile does not load to and fro.
class TiledPlaneMap final : public PlaneMapSource {
 public:
  /// Tiles, with all planes fitted.
  struct Content {
    PlaneMapOptions options;
    int tile_voxels = 0;
    std::unique_ptr<SpoolFile> spool;  ///< of VoxelPlane
    std::map<TileIndex, TilePiece> tiles;
    PlaneThickness thickness;
    std::int64_t planes = 0;  ///< of the whole map
  };

  /// `reach_m`: how far from the position given to `around` planes are looked for.
  TiledPlaneMap(Content content, double reach_m);

  /// Thread-safe. Throws InputError where the disk fails.
  std::shared_ptr<const PlaneMap> around(const Vector3& position) const override;

  double voxel_m() const override { return content_.options.voxel_m; }
  void for_each_voxel(const VoxelVisitor& visit) const override;

  std::int64_t planes() const { return content_.planes; }
  std::size_t tiles() const { return content_.tiles.size(); }
  double tile_m() const { return content_.tile_voxels * content_.options.voxel_m; }
  double resident_radius_m() const { return reach_m_ + moves_m_; }

  /// How often tiles were loaded so far.
  std::int64_t loads() const;

 private:
  struct Residence {
    Eigen::Vector2d center;
    std::weak_ptr<const PlaneMap> map;
  };
  std::shared_ptr<const PlaneMap> load(const Eigen::Vector2d& center) const;

  Content content_;
  double reach_m_;
  double moves_m_;  ///< from the centre of what is in memory, before other tiles are loaded
  mutable std::mutex mutex_;
  mutable std::shared_ptr<const PlaneMap> newest_;  ///< held by no one else while no one looks
  mutable std::vector<Residence> residences_;
  mutable std::int64_t loads_ = 0;
};

/// Cuts a cloud of any size into tiles and fits their planes. Memory: `buffer_bytes` of points while they come, then
/// one tile's points.
class TiledPlaneMapBuilder {
 public:
  /// `folder`: takes the temporary files. Throws InputError where it does not.
  TiledPlaneMapBuilder(const PlaneMapOptions& options, const std::string& folder,
                       std::size_t buffer_bytes = 64U << 20U);

  /// The next points of the cloud (map frame, metres; finite), in its order.
  void add(std::span<const Eigen::Vector3f> points);

  /// Fits all tiles and hands the map over; nothing can be added any more.
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

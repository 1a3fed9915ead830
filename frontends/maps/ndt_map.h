#pragma once

#include <deque>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/lidar/ndt_options.h"
#include "core/lidar/scan_matcher.h"
#include "core/mapping/voxel_means.h"
#include "core/sensor_suite.h"
#include "core/warnings.h"

namespace lodestone {

/// The cloud map as normal distributions in cells (Magnusson 2009), and the registration of scans with them: PCL's
/// NormalDistributionsTransform. The thinned cloud is in memory in tiles. A scan is registered with the tiles within
/// reach of the guess' tile, whose cells are those of the whole map (docs/design/056-ndt.md).
class NdtMap final : public ScanMatcher {
 public:
  /// `cloud`: the thinned map, map frame less `local_origin_m`: PCL's floats are too coarse far from their origin.
  /// `reach_m`: largest distance of required cells from the robot.
  NdtMap(const VoxelMeans& cloud, const NdtOptions& options, double reach_m,
         const Vector3& local_origin_m = Vector3::Zero());
  ~NdtMap() override;

  std::optional<ScanMatch> match(std::span<const Eigen::Vector3f> points, const Pose& guess) override;

  std::size_t points() const { return points_; }
  double tile_m() const { return tile_m_; }

 private:
  using TileIndex = std::pair<int, int>;
  struct Target;
  Target& target_around(const Vector3& position);

  NdtOptions options_;
  double reach_m_;
  double tile_m_;
  Vector3 local_origin_m_;  // tiles, guess and result within PCL are less this
  std::size_t points_ = 0;
  std::map<TileIndex, std::vector<Eigen::Vector3f>> tiles_;
  std::deque<std::unique_ptr<Target>> targets_;  // the newest last
};

/// The NDT map of a cloud map less `origin_m`. Throws InputError (as read_point_cloud). Faults of the file that
/// load_planes counts are not counted again; points farther from the first ones than the range of voxel indices are
/// ("cloud.far_points").
std::shared_ptr<NdtMap> load_ndt_map(const std::string& path, const NdtOptions& options,
                                     std::span<const LidarModel> lidars, WarningLog& warnings,
                                     const Vector3& origin_m = Vector3::Zero());

}  // namespace lodestone

#pragma once

#include <cstdint>
#include <unordered_map>
#include <vector>

#include "core/bit_mix.h"
#include "core/geometry/so3.h"

namespace lodestone {

/// The mean of the points in one voxel.
struct VoxelMean {
  std::uint64_t voxel = 0;                             ///< voxel_key
  Eigen::Vector3f position = Eigen::Vector3f::Zero();  ///< map, metres
  std::uint32_t points = 0;
};

/// Averages a stream of points in voxels. Memory grows with the surfaces of the map, about 80 bytes a voxel, not with
/// the number of points.
class VoxelMeans {
 public:
  /// Throws std::invalid_argument if the edge is not positive.
  explicit VoxelMeans(double voxel_m);

  /// Adds a point, map frame, metres. Points beyond voxels_reach_m on an axis are ignored.
  void add(const Eigen::Vector3f& point);

  /// Voxels with at least one point.
  std::size_t size() const { return sums_.size(); }

  /// Voxels with at least `min_points` points, in order of their keys. The result depends on the order of the points
  /// by rounding only.
  std::vector<VoxelMean> means(int min_points) const;

 private:
  struct Sum {
    Vector3 offset = Vector3::Zero();  ///< from the voxel's lower corner
    std::uint32_t points = 0;
  };
  struct KeyHash {
    std::size_t operator()(std::uint64_t key) const { return mix(key); }
  };

  double voxel_m_;
  float inverse_voxel_;
  float reach_m_;
  std::unordered_map<std::uint64_t, Sum, KeyHash> sums_;
};

}  // namespace lodestone

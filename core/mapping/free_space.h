#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "core/bit_mix.h"
#include "core/lidar/plane_map.h"
#include "core/mapping/voxel_means.h"

namespace lodestone {

/// A return of a LiDAR: the beam is free from `origin` to `end`. Map frame, metres.
struct LidarRay {
  Eigen::Vector3f origin = Eigen::Vector3f::Zero();
  Eigen::Vector3f end = Eigen::Vector3f::Zero();
};

/// Finds the voxels of a cloud map that rays show to be free: traces of moving objects. A voxel is occupied in a scan
/// if a ray ends in it, and free if no ray ends in it and a ray passes its mean point well in front of the surface on
/// which the ray ends. The log odds of occupancy are the sum over all scans, with OctoMap's probabilities (Hornung et
/// al., Autonomous Robots 2013), in any order of time. docs/design/052
class FreeSpace {
 public:
  /// `voxels`: the map to test, with edge `voxel_m`. Throws std::invalid_argument if voxel_m is not positive.
  FreeSpace(std::vector<VoxelMean> voxels, double voxel_m);

  /// Counts the rays of one scan. The result does not depend on the number of threads.
  void add_scan(std::span<const LidarRay> rays);

  /// Voxels that are more probably occupied than free, or were not observed.
  std::vector<VoxelMean> occupied() const;

  std::size_t size() const { return voxels_.size(); }

 private:
  /// Scans in which a voxel was hit or passed, and the last of them.
  struct Evidence {
    std::uint32_t hits = 0;
    std::uint32_t passes = 0;
    std::uint32_t last_hit = 0;
    std::uint32_t last_pass = 0;
  };
  /// A range of voxels_.
  struct Range {
    std::uint32_t begin = 0;
    std::uint32_t end = 0;
  };
  struct KeyHash {
    std::size_t operator()(std::uint64_t key) const { return mix(key); }
  };

  bool hit(const Eigen::Vector3f& end);
  void append_passed(const LidarRay& ray, const Plane& surface, std::vector<std::uint32_t>& passed) const;

  std::vector<VoxelMean> voxels_;  ///< in order of blocks
  std::vector<Evidence> evidence_;
  std::unordered_map<std::uint64_t, Range, KeyHash> blocks_;
  double voxel_m_;
  float in_front_m_;
  PlaneMap surfaces_;
  std::uint32_t scan_ = 0;  ///< number of the scan, from 1
};

}  // namespace lodestone

#include "core/lidar/voxel_planes.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "core/lidar/voxel_members.h"
#include "core/parallel.h"

namespace lodestone {

namespace {

// Of one axis in a voxel's key.
constexpr int kBits = 21;
constexpr int kOffset = voxels_to_a_side;
static_assert(kOffset == 1 << (kBits - 1));

using Wanted = std::function<bool(const Eigen::Vector3i&)>;

/// Puts the plane's height to where those of its points are whose foot on it lies within the voxel, which scans will
/// meet. The margin is there for walls in a voxel's face, and for a steady normal; sideways it makes the chord of a
/// curved surface longer than the voxel, and so too deep where it is used. Normal and thickness stay those of the whole
/// box: of the voxel alone the normal has five times the variance, and noise of normals pretends to see along a tunnel.
void take_height_from_within(std::span<const Eigen::Vector3f> points, std::span<const VoxelMember> members,
                             const PlaneMapOptions& options, Plane& plane) {
  constexpr float kTolerance_m = 0.005F;  // for walls whose noise crosses the voxel's faces
  const auto edge = static_cast<float>(options.voxel_m);
  const Eigen::Vector3f low = voxel_of_key(members.front().key).cast<float>() * edge;
  Vector3 sum = Vector3::Zero();
  int count = 0;
  for (const VoxelMember& member : members) {
    const Eigen::Vector3f& point = points[member.index];
    const Eigen::Vector3f foot = point - plane.normal * plane.distance(point) - low;
    if ((foot.array() < -kTolerance_m).any() || (foot.array() > edge + kTolerance_m).any()) continue;
    sum += (point - low).cast<double>();
    ++count;
  }
  if (count < options.fit.min_points) return;
  plane.center = low + (sum / count).cast<float>();
  plane.offset_variance *= static_cast<float>(plane.count) / static_cast<float>(count);
}

}  // namespace

std::uint64_t voxel_key(const Eigen::Vector3i& voxel) {
  const auto part = [](int value) { return static_cast<std::uint64_t>(value + kOffset) & ((1U << kBits) - 1U); };
  return part(voxel.x()) << (2 * kBits) | part(voxel.y()) << kBits | part(voxel.z());
}

Eigen::Vector3i voxel_of_key(std::uint64_t key) {
  const auto part = [key](int shift) { return static_cast<int>(key >> shift & ((1U << kBits) - 1U)) - kOffset; };
  return {part(2 * kBits), part(kBits), part(0)};
}

VoxelMembership::VoxelMembership(const PlaneMapOptions& options)
    : inverse_voxel_(static_cast<float>(1.0 / options.voxel_m)),
      margin_(static_cast<float>(options.margin_m) * inverse_voxel_) {
  if (!(options.voxel_m > 0.0)) throw std::invalid_argument("PlaneMap: voxel_m must be positive");
  if (!(options.margin_m >= 0.0 && options.margin_m < 0.5 * options.voxel_m)) {
    throw std::invalid_argument("PlaneMap: margin_m must be at least zero and less than half of voxel_m");
  }
}

std::vector<VoxelPlane> fit_voxel_planes(std::span<const Eigen::Vector3f> points, const PlaneMapOptions& options,
                                         const Wanted& wanted) {
  const std::vector<VoxelMember> entries = sorted_members(points, options, wanted);
  const std::vector<std::size_t> starts = voxel_starts(entries);
  std::vector<VoxelPlane> voxels(starts.size() - 1);
  parallel_for(std::size_t{0}, voxels.size(), [&](std::size_t v) {
    const Eigen::Vector3d reference = points[entries[starts[v]].index].cast<double>();
    PointMoments moments;
    for (std::size_t i = starts[v]; i < starts[v + 1]; ++i) {
      moments.add(points[entries[i].index].cast<double>() - reference);
    }
    voxels[v].key = entries[starts[v]].key;
    voxels[v].is_plane = fit_plane(moments, reference, options.fit, voxels[v].plane) ? 1 : 0;
    if (voxels[v].is_plane != 0 && options.height_from_within) {
      take_height_from_within(points, std::span(entries).subspan(starts[v], starts[v + 1] - starts[v]), options,
                              voxels[v].plane);
    }
  });
  return voxels;
}

double PlaneThickness::log_spread() const {
  return low_m > 0.0 ? std::log(median_m / low_m) : 0.0;
}

double thickness_limit(const PlaneThickness& thickness, const PlaneMapOptions& options) {
  constexpr double kStandardDeviations = 3.0;
  if (!(options.max_thickness_over_median > 0.0)) return std::numeric_limits<double>::infinity();
  return thickness.median_m *
         std::max(options.max_thickness_over_median, std::exp(kStandardDeviations * thickness.log_spread()));
}

Plane with_shared_thickness(Plane plane, const PlaneThickness& thickness, const PlaneMapOptions& options) {
  // The logarithm of a variance of ν degrees of freedom has a variance of about 2 / ν.
  const double variance_of_log = std::pow(2.0 * thickness.log_spread(), 2);
  const double prior = variance_of_log > 0.0 ? std::min(options.thickness_prior_points, 2.0 / variance_of_log)
                                             : options.thickness_prior_points;
  const double own = static_cast<double>(plane.count) - 3.0;
  const double squared = std::pow(static_cast<double>(plane.thickness), 2);
  if (prior <= 0.0 || own <= 0.0 || squared <= 0.0) return plane;
  const auto factor = static_cast<float>((prior * std::pow(thickness.median_m, 2) / squared + own) / (prior + own));
  plane.offset_variance *= factor;
  plane.major_tilt_variance *= factor;
  plane.minor_tilt_variance *= factor;
  return plane;
}

}  // namespace lodestone

#include "core/lidar/cloud_quality.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <vector>

#include "core/lidar/map_error.h"
#include "core/lidar/plane_map.h"
#include "core/lidar/voxel_members.h"
#include "core/parallel.h"

namespace lodestone {

namespace {

// Above it, of 1500 samples of 12 to 60 points, fewer than one in a thousand of Gaussian and three in a hundred of
// uniform layers are taken for two; layers six thicknesses apart are found in four of five of 20 points.
constexpr double kSeparate = 4.5;
constexpr double kLeastShare = 0.2;  // of a voxel's points in the smaller layer
constexpr double kParallel = 0.95;   // cosine: layers of few points have normals that differ by some degrees

/// What one voxel shows.
struct VoxelQuality {
  std::int64_t own = 0;      ///< points within it, without those of the margin
  double weight = 0.0;       ///< of its surface: a wall in a voxel's face belongs to two voxels
  double thickness_m = 0.0;  ///< of its plane; 0 without one
  double per_m2 = 0.0;
  double distance_m = 0.0;  ///< of two layers; 0 where they are not two
  Eigen::Vector3f center = Eigen::Vector3f::Zero();
};

double unbiased_variance(const Plane& plane) {
  return std::pow(static_cast<double>(plane.thickness), 2) * plane.count / (plane.count - 3.0);
}

/// The points of one voxel.
class VoxelPoints {
 public:
  VoxelPoints(std::span<const Eigen::Vector3f> points, std::span<const VoxelMember> members,
              const PlaneMapOptions& options)
      : options_(options), reference_(points[members.front().index].cast<double>()) {
    for (const VoxelMember& member : members) {
      points_.push_back(points[member.index].cast<double>() - reference_);
      moments_.add(points_.back());
    }
    const double count = static_cast<double>(moments_.count);
    const Vector3 mean = moments_.sum / count;
    covariance_ = moments_.outer / count - mean * mean.transpose();
  }

  bool fit(Plane& plane) const { return fit_plane(moments_, reference_, options_.fit, plane); }

  /// Points a square metre, as if they were spread evenly over a rectangle: its variances are its sides' squares / 12.
  double per_m2(const Plane& plane) const {
    const Vector3 major = plane.major.cast<double>();
    const Vector3 minor = plane.normal.cast<double>().cross(major);
    const double area = 12.0 * std::sqrt(major.dot(covariance_ * major) * minor.dot(covariance_ * minor));
    return area > 0.0 ? static_cast<double>(moments_.count) / area : 0.0;
  }

  /// Distance of two layers, if there are two.
  std::optional<double> layers() {
    const auto count = static_cast<std::ptrdiff_t>(points_.size());
    const auto least = std::max<std::ptrdiff_t>(std::max(options_.fit.min_points, 4),
                                                static_cast<std::ptrdiff_t>(std::ceil(kLeastShare * count)));
    if (count < 2 * least) return std::nullopt;
    const Vector3 across = Eigen::SelfAdjointEigenSolver<Matrix3>(covariance_).eigenvectors().col(0);
    std::stable_sort(points_.begin(), points_.end(),
                     [&](const Vector3& a, const Vector3& b) { return across.dot(a) < across.dot(b); });
    const std::ptrdiff_t cut = threshold(across);
    if (cut < least || count - cut < least) return std::nullopt;
    Plane low, high;
    if (!fit_part(0, cut, low) || !fit_part(cut, count, high)) return std::nullopt;
    const Vector3 low_normal = low.normal.cast<double>();
    Vector3 high_normal = high.normal.cast<double>();
    if (low_normal.dot(high_normal) < 0.0) high_normal = -high_normal;
    if (low_normal.dot(high_normal) < kParallel) return std::nullopt;
    const Vector3 normal = (low_normal + high_normal).normalized();
    const Vector3 step = (high.center - low.center).cast<double>();
    const double distance = std::abs(normal.dot(step));
    const double spread = std::sqrt(0.5 * (unbiased_variance(low) + unbiased_variance(high)));
    if (distance <= kSeparate * spread || distance > options_.margin_m) return std::nullopt;
    // Two treads of a step lie beside each other.
    const Vector3 aside = step - normal * normal.dot(step);
    if (aside.norm() > 0.0) {
      const Vector3 direction = aside.normalized();
      const double variance = 0.5 * (variance_of(0, cut, direction) + variance_of(cut, count, direction));
      if (aside.squaredNorm() > variance) return std::nullopt;
    }
    return distance;
  }

 private:
  /// Otsu: the number of points below the threshold of the largest variance between both classes.
  std::ptrdiff_t threshold(const Vector3& across) const {
    double all = 0.0;
    for (const Vector3& point : points_) all += across.dot(point);
    const double count = static_cast<double>(points_.size());
    double below = 0.0, largest = -1.0;
    std::size_t best = 0;
    for (std::size_t i = 1; i < points_.size(); ++i) {
      below += across.dot(points_[i - 1]);
      const double under = static_cast<double>(i);
      const double between = under * (count - under) * std::pow(below / under - (all - below) / (count - under), 2);
      if (between <= largest) continue;
      largest = between;
      best = i;
    }
    return static_cast<std::ptrdiff_t>(best);
  }

  bool fit_part(std::ptrdiff_t begin, std::ptrdiff_t end, Plane& plane) const {
    PointMoments part;
    std::for_each(points_.begin() + begin, points_.begin() + end, [&](const Vector3& point) { part.add(point); });
    return fit_plane(part, reference_, options_.fit, plane);
  }

  double variance_of(std::ptrdiff_t begin, std::ptrdiff_t end, const Vector3& direction) const {
    double sum = 0.0, squares = 0.0;
    for (std::ptrdiff_t i = begin; i < end; ++i) {
      const double value = direction.dot(points_[static_cast<std::size_t>(i)]);
      sum += value;
      squares += value * value;
    }
    const double count = static_cast<double>(end - begin);
    return squares / count - std::pow(sum / count, 2);
  }

  const PlaneMapOptions& options_;
  Vector3 reference_;
  std::vector<Vector3> points_;  // less the reference
  PointMoments moments_;
  Matrix3 covariance_;
};

VoxelQuality measure_voxel(std::span<const Eigen::Vector3f> points, std::span<const VoxelMember> members,
                           const PlaneMapOptions& options) {
  VoxelQuality result;
  const Eigen::Vector3i voxel = voxel_of_key(members.front().key);
  const auto inverse = static_cast<float>(1.0 / options.voxel_m);
  for (const VoxelMember& member : members) result.own += voxel_of(points[member.index], inverse) == voxel ? 1 : 0;
  if (result.own == 0) return result;
  result.weight = static_cast<double>(result.own) / static_cast<double>(members.size());
  VoxelPoints content(points, members, options);
  Plane plane;
  const bool is_plane = content.fit(plane);
  result.distance_m = content.layers().value_or(0.0);
  result.center = (voxel.cast<float>().array() + 0.5F).matrix() * static_cast<float>(options.voxel_m);
  if (result.distance_m > 0.0 || !is_plane) return result;
  result.thickness_m = std::sqrt(unbiased_variance(plane));
  result.per_m2 = content.per_m2(plane);
  return result;
}

/// The value of the lowest rank that a share of at least `share` does not exceed; 0 without values.
double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0.0;
  const auto place = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), place, values.end());
  return *place;
}

void sum_up(std::span<const VoxelQuality> voxels, CloudQuality& quality) {
  struct Place {
    double weight = 0.0;
    Vector3 sum = Vector3::Zero();
  };
  std::map<std::array<int, 3>, Place> places;
  std::vector<double> thickness, distances, per_voxel, per_m2;
  double surface = 0.0, doubled = 0.0;
  for (const VoxelQuality& voxel : voxels) {
    if (voxel.own == 0) continue;
    ++quality.voxels;
    per_voxel.push_back(static_cast<double>(voxel.own));
    if (voxel.thickness_m > 0.0 || voxel.per_m2 > 0.0) {
      ++quality.planes;
      thickness.push_back(voxel.thickness_m);
      per_m2.push_back(voxel.per_m2);
      surface += voxel.weight;
    }
    if (voxel.distance_m <= 0.0) continue;
    distances.push_back(voxel.distance_m);
    surface += voxel.weight;
    doubled += voxel.weight;
    const Eigen::Vector3i cube = (voxel.center / static_cast<float>(kMapErrorCube_m)).array().floor().cast<int>();
    Place& place = places[{cube.x(), cube.y(), cube.z()}];
    place.weight += voxel.weight;
    place.sum += voxel.weight * voxel.center.cast<double>();
  }
  quality.median_thickness_m = quantile(thickness, 0.5);
  quality.ninetieth_thickness_m = quantile(thickness, 0.9);
  quality.median_points_per_voxel = quantile(per_voxel, 0.5);
  quality.median_points_per_m2 = quantile(per_m2, 0.5);
  quality.doubled_distance_m = quantile(distances, 0.5);
  quality.doubled_share = surface > 0.0 ? doubled / surface : 0.0;
  double most = 0.0;
  for (const auto& [cube, place] : places) {
    if (place.weight <= most) continue;
    most = place.weight;
    quality.doubled_place_m = (place.sum / place.weight).cast<float>();
  }
}

}  // namespace

CloudQuality measure_cloud(std::span<const Eigen::Vector3f> points, const PlaneMapOptions& options) {
  CloudQuality quality;
  quality.points = static_cast<std::int64_t>(points.size());
  if (points.empty()) return quality;
  quality.low_m = quality.high_m = points.front();
  for (const Eigen::Vector3f& point : points) {
    quality.low_m = quality.low_m.cwiseMin(point);
    quality.high_m = quality.high_m.cwiseMax(point);
  }
  {
    const PlaneMap map(points, options);
    const auto on_planes = std::count_if(points.begin(), points.end(),
                                         [&map](const Eigen::Vector3f& point) { return map.at(point) != nullptr; });
    quality.on_planes_share = static_cast<double>(on_planes) / static_cast<double>(points.size());
  }
  const std::vector<VoxelMember> members = sorted_members(points, options);
  const std::vector<std::size_t> starts = voxel_starts(members);
  std::vector<VoxelQuality> voxels(starts.size() - 1);
  parallel_for(std::size_t{0}, voxels.size(), [&](std::size_t v) {
    voxels[v] = measure_voxel(points, std::span(members).subspan(starts[v], starts[v + 1] - starts[v]), options);
  });
  sum_up(voxels, quality);
  return quality;
}

}  // namespace lodestone

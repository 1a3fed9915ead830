#include "core/lidar/double_surfaces.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include "core/lidar/voxel_planes.h"
#include "core/middle_value.h"

namespace lodestone {

namespace {

constexpr std::size_t kFewest = 40;    // with so many points on one surface, one voxel in 700 appears to have two
constexpr double kLeastSpread = 0.16;  // of a voxel's edge: sigma along the surface; 0.29 if evenly covered
constexpr double kLeastBetween = 0.8;  // of the variance; reached by two surfaces 3.5 sigmas of noise apart
constexpr double kLeastShare = 0.2;    // of the points, in the smaller part
constexpr double kLeastDistance_m = 0.015;
constexpr double kMostDistance_m = 0.05;  // the sides of boards and thin walls are further apart
constexpr double kMostAside = 0.2;        // of a voxel's edge: two parts further aside are a step or an edge

/// Distance between two surfaces in one voxel, m. 0: one surface. Negative: not flat.
double distance_within(std::span<const Eigen::Vector3f> points, double voxel_m) {
  const Vector3 reference = points.front().cast<double>();
  PointMoments moments;
  for (const Eigen::Vector3f& point : points) moments.add(point.cast<double>() - reference);
  const auto count = static_cast<double>(moments.count);
  const Vector3 mean = moments.sum / count;
  const Matrix3 covariance = moments.outer / count - mean * mean.transpose();
  const Eigen::SelfAdjointEigenSolver<Matrix3> axes(covariance);
  if (std::sqrt(axes.eigenvalues()[1]) < kLeastSpread * voxel_m) return -1.0;
  if (axes.eigenvalues()[0] > 0.25 * axes.eigenvalues()[1]) return -1.0;
  const Vector3 normal = axes.eigenvectors().col(0);
  std::vector<std::pair<double, Vector3>> heights;
  for (const Eigen::Vector3f& point : points) {
    const Vector3 away = point.cast<double>() - reference - mean;
    heights.emplace_back(normal.dot(away), away);
  }
  std::sort(heights.begin(), heights.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  double sum = 0.0;
  double best = 0.0;
  std::size_t split = 0;
  for (std::size_t i = 0; i + 1 < heights.size(); ++i) {
    sum += heights[i].first;
    const auto below = static_cast<double>(i + 1);
    const double between = sum * sum / (below * (count - below));  // the mean of all is zero
    if (between > best) {
      best = between;
      split = i + 1;
    }
  }
  const auto below = static_cast<double>(split);
  if (best < kLeastBetween * axes.eigenvalues()[0] || std::min(below, count - below) < kLeastShare * count) return 0.0;
  Vector3 low = Vector3::Zero();
  Vector3 high = Vector3::Zero();
  for (std::size_t i = 0; i < heights.size(); ++i) (i < split ? low : high) += heights[i].second;
  const Vector3 step = high / (count - below) - low / below;
  const double distance_m = normal.dot(step);
  const bool behind = (step - distance_m * normal).norm() < kMostAside * voxel_m;
  return behind && distance_m >= kLeastDistance_m && distance_m <= kMostDistance_m ? distance_m : 0.0;
}

}  // namespace

DoubleSurfaces find_double_surfaces(std::span<const Eigen::Vector3f> points, double voxel_m) {
  const auto inverse = static_cast<float>(1.0 / voxel_m);
  std::vector<std::pair<std::uint64_t, Eigen::Vector3f>> sorted;
  sorted.reserve(points.size());
  for (const Eigen::Vector3f& point : points) sorted.emplace_back(voxel_key(voxel_of(point, inverse)), point);
  std::sort(sorted.begin(), sorted.end(), [](const auto& a, const auto& b) {
    if (a.first != b.first) return a.first < b.first;
    return std::lexicographical_compare(a.second.data(), a.second.data() + 3, b.second.data(), b.second.data() + 3);
  });
  DoubleSurfaces result;
  std::vector<double> distances;
  std::vector<Eigen::Vector3f> own;
  for (std::size_t begin = 0; begin < sorted.size();) {
    own.clear();
    std::size_t end = begin;
    for (; end < sorted.size() && sorted[end].first == sorted[begin].first; ++end) own.push_back(sorted[end].second);
    begin = end;
    if (own.size() < kFewest) continue;
    const double distance_m = distance_within(own, voxel_m);
    if (distance_m < 0.0) continue;
    ++result.looked_at;
    if (distance_m > 0.0) distances.push_back(distance_m);
  }
  result.found = distances.size();
  if (!distances.empty()) result.distance_m = middle_value(distances);
  return result;
}

}  // namespace lodestone

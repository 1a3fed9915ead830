#include "core/lidar/cube_sums.h"

#include <cmath>
#include <map>

#include "core/lidar/prefetch_plane.h"

namespace lodestone {

namespace {

/// The share of an edge by which faces of cubes lie beside round coordinates.
constexpr double kFirstFace = 0.382;

}  // namespace

MapErrorCube map_error_cube(const Vector3& place) {
  MapErrorCube cube;
  for (int axis = 0; axis < 3; ++axis) {
    cube[static_cast<std::size_t>(axis)] = static_cast<int>(std::floor(place[axis] / kMapErrorCube_m + kFirstFace));
  }
  return cube;
}

MapErrorCube cell_of(const MapErrorCube& cube) {
  return {cube[0] >> 1, cube[1] >> 1, cube[2] >> 1};  // rounds down (C++20)
}

ScanSums sum_by_cubes(std::span<const Correspondence> correspondences, const Pose& T_map_imu) {
  const Matrix3 rotation = T_map_imu.rotation.toRotationMatrix();
  // Ordered, so that sums are the same on every machine.
  std::map<MapErrorCube, std::size_t> places;
  std::vector<CubeSums> cubes;
  ScanSums result;
  result.cube_of.reserve(correspondences.size());
  for (std::size_t i = 0; i < correspondences.size(); ++i) {
    prefetch_plane(correspondences, i);
    const Correspondence& match = correspondences[i];
    const Vector3 normal = match.plane->normal.cast<double>();
    const Vector3 arm = rotation * match.point.cast<double>();
    const Vector3 center = match.plane->center.cast<double>();
    const MapErrorCube key = map_error_cube(center);
    if (result.cube_of.empty() || cubes[result.cube_of.back()].key != key) {
      const auto [found, added] = places.try_emplace(key, cubes.size());
      if (added) cubes.emplace_back().key = key;
      result.cube_of.push_back(found->second);
    } else {
      result.cube_of.push_back(result.cube_of.back());
    }
    CubeSums& cube = cubes[result.cube_of.back()];
    const double once = match.variance_once > 0.0F ? static_cast<double>(match.variance_once) : 0.0;
    const double weight = static_cast<double>(match.robust_weight) / (once > 0.0 ? once : match.variance);
    const double residual = normal.dot(arm + T_map_imu.position - center);
    Vector6 jacobian;
    jacobian << arm.cross(normal), normal;
    const Vector6 weighed = weight * jacobian;
    result.information.noalias() += weighed * jacobian.transpose();
    result.gradient += residual * weighed;
    cube.coupling.noalias() += weighed * normal.transpose();
    cube.residual += (weight * residual) * normal;
    cube.center += weight * center;
    cube.weights += weight;
    const auto add_spurious = [&](const Vector3& axis, double variance) {
      Vector6 error;
      error << arm.cross(axis), axis;
      const Vector6 weighed_error = (weight * variance) * error;
      result.spurious.noalias() += weighed_error * error.transpose();
      cube.spurious.noalias() += weighed_error * axis.transpose();
    };
    const Vector3 major = match.plane->major.cast<double>();
    add_spurious(major, match.plane->major_tilt_variance);
    add_spurious(normal.cross(major), match.plane->minor_tilt_variance);
  }
  std::vector<std::size_t> rank(cubes.size());
  for (const auto& [key, place] : places) {
    rank[place] = result.cubes.size();
    CubeSums& cube = result.cubes.emplace_back(cubes[place]);
    cube.weight = cube.coupling.bottomRows<3>();
    cube.center /= cube.weights;
  }
  for (std::size_t& place : result.cube_of) place = rank[place];
  return result;
}

}  // namespace lodestone

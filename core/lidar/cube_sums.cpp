#include "core/lidar/cube_sums.h"

#include <cmath>
#include <map>

#include "core/lidar/prefetch_plane.h"

namespace lodestone {

namespace {

/// The share of an edge by which faces of cubes lie beside round coordinates.
constexpr double kFirstFace = 0.382;

/// Σ w v vᵀ of v = [a × e; e]: the part of the rotations, and [φ; p] × e, whose sum has the other three parts.
struct Moments {
  Matrix3 rotations = Matrix3::Zero();

  void add(double weight, const Vector3& arm, const Vector3& axis, Matrix6x3& coupling) {
    const Vector3 turn = arm.cross(axis);
    const Vector3 weighed_turn = weight * turn;
    rotations.noalias() += weighed_turn * turn.transpose();
    coupling.topRows<3>().noalias() += weighed_turn * axis.transpose();
    coupling.bottomRows<3>().noalias() += (weight * axis) * axis.transpose();
  }

  Matrix6 total(const Matrix6x3& coupling) const {
    Matrix6 result;
    result << rotations, coupling.topRows<3>(), coupling.topRows<3>().transpose(), coupling.bottomRows<3>();
    return result;
  }
};

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

ScanSums sum_by_cubes(std::span<const Correspondence> correspondences, const Pose& T_map_imu, bool with_spurious) {
  const Matrix3 rotation = T_map_imu.rotation.toRotationMatrix();
  // Ordered, so that sums are the same on every machine.
  std::map<MapErrorCube, std::size_t> places;
  std::vector<CubeSums> cubes;
  ScanSums result;
  result.cube_of.reserve(correspondences.size());
  Moments information;
  Moments spurious;
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
    const Vector3 weighed_residual = (weight * residual) * normal;
    information.add(weight, arm, normal, cube.coupling);
    result.gradient.head<3>() += arm.cross(weighed_residual);
    cube.residual += weighed_residual;
    cube.center += weight * center;
    cube.weights += weight;
    if (!with_spurious) continue;
    const Vector3 major = match.plane->major.cast<double>();
    spurious.add(weight * match.plane->major_tilt_variance, arm, major, cube.spurious);
    spurious.add(weight * match.plane->minor_tilt_variance, arm, normal.cross(major), cube.spurious);
  }
  std::vector<std::size_t> rank(cubes.size());
  Matrix6x3 coupling = Matrix6x3::Zero();
  Matrix6x3 spurious_coupling = Matrix6x3::Zero();
  for (const auto& [key, place] : places) {
    rank[place] = result.cubes.size();
    CubeSums& cube = result.cubes.emplace_back(cubes[place]);
    cube.weight = cube.coupling.bottomRows<3>();
    cube.center /= cube.weights;
    coupling += cube.coupling;
    spurious_coupling += cube.spurious;
    result.gradient.tail<3>() += cube.residual;
  }
  result.information = information.total(coupling);
  result.spurious = spurious.total(spurious_coupling);
  for (std::size_t& place : result.cube_of) place = rank[place];
  return result;
}

}  // namespace lodestone

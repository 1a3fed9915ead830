#include "core/lidar/map_error.h"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <map>

namespace lodestone {

namespace {

using Key = MapErrorCube;

/// The share of an edge by which faces of cubes lie beside round coordinates.
constexpr double kFirstFace = 0.382;

constexpr std::size_t kFewestCubes = 4;
constexpr double kLeastLeft = 0.02;

/// The finer scales hold what planes, sensors and things that were moved do; the place is not displaced by them.
constexpr int kFirstScaleOfPlaces = 2;

/// A cube whose points know their mean better than this counts fully in the estimate of the variance.
constexpr double kWellKnown_m = 0.005;

/// The cube of a coarser scale. A shift of a negative number rounds down (C++20).
Key coarser(const Key& key, int scale) {
  return {key[0] >> scale, key[1] >> scale, key[2] >> scale};
}

struct Cube {
  Matrix6x3 coupling = Matrix6x3::Zero();  // Σ w J nᵀ
  Matrix3 weight = Matrix3::Zero();        // Σ w n nᵀ
  Vector3 residual = Vector3::Zero();      // Σ w n r
};

Matrix6 symmetric(const Matrix6& matrix) {
  return 0.5 * (matrix + matrix.transpose());
}

/// The cubes of one scale, joined from those of the finest.
struct Joined {
  Vector3 offset_m = Vector3::Zero();
  Vector3 other_offset_m = Vector3::Zero();
  Matrix3 gain = Matrix3::Zero();
  Matrix3 other_gain = Matrix3::Zero();
  Matrix6x3 coupling = Matrix6x3::Zero();
  Matrix6x3 by_pose = Matrix6x3::Zero();
};

}  // namespace

MapErrorCube map_error_cube(const Vector3& place, int scale) {
  MapErrorCube cube;
  for (int axis = 0; axis < 3; ++axis) {
    cube[static_cast<std::size_t>(axis)] = static_cast<int>(std::floor(place[axis] / kMapErrorCube_m + kFirstFace));
  }
  return coarser(cube, scale);
}

MapError::MapError() {
  pose_covariance.fill(Matrix6::Zero());
  fit_covariance.fill(Matrix6::Zero());
}

Matrix6 MapError::pose_covariance_of(const MapErrorVariances& variances_m2) const {
  Matrix6 result = Matrix6::Zero();
  for (int s = 0; s < kMapErrorScales; ++s) result += variances_m2[s] * pose_covariance[static_cast<std::size_t>(s)];
  return result;
}

Matrix6 pose_error_root(const Matrix6& covariance) {
  constexpr double kLeast = 1e-6;
  const Eigen::LLT<Matrix6> root(covariance + kLeast * kLeast * Matrix6::Identity());
  if (root.info() != Eigen::Success) return kLeast * Matrix6::Identity();
  return root.matrixL();
}

double MapError::length_m_of(const MapErrorVariances& variances_m2) const {
  double sum = 0.0;
  double weighed = 0.0;
  for (int s = 0; s < kMapErrorScales; ++s) {
    const double own = variances_m2[s] * pose_covariance[static_cast<std::size_t>(s)].bottomRightCorner<3, 3>().trace();
    sum += own;
    weighed += own * map_error_cube_m(s);
  }
  return sum > 0.0 ? weighed / sum : kMapErrorCube_m;
}

MapError analyse_map_error(std::span<const Correspondence> correspondences, const Pose& T_map_seen) {
  const Matrix3 rotation = T_map_seen.rotation.toRotationMatrix();
  // Ordered: the same sums on every machine.
  std::map<Key, Cube> cubes;
  Matrix6 information = Matrix6::Zero();
  Vector6 gradient = Vector6::Zero();
  Key last_key{};
  Cube* last = nullptr;
  for (const Correspondence& match : correspondences) {
    const Vector3 normal = match.plane->normal.cast<double>();
    const Vector3 arm = rotation * match.point.cast<double>();
    const Vector3 center = match.plane->center.cast<double>();
    const Key key = map_error_cube(center, 0);
    if (last == nullptr || key != last_key) {
      last = &cubes[key];
      last_key = key;
    }
    const double once = match.variance_once > 0.0F ? static_cast<double>(match.variance_once) : 0.0;
    const double weight = static_cast<double>(match.robust_weight) / (once > 0.0 ? once : match.variance);
    Vector6 jacobian;
    jacobian << arm.cross(normal), normal;
    const Vector3 weighed = weight * normal;
    const double residual = normal.dot(arm + T_map_seen.position - center);
    last->coupling.noalias() += jacobian * weighed.transpose();
    last->weight.noalias() += weighed * normal.transpose();
    last->residual += residual * weighed;
    gradient += (weight * residual) * jacobian;
    information.noalias() += (weight * jacobian) * jacobian.transpose();
  }
  MapError result;
  if (cubes.size() < kFewestCubes) return result;

  // Keeps the factorization defined along a direction that no point sees.
  information.diagonal() *= 1.0 + 1e-9;
  const Eigen::LDLT<Matrix6> factor(information);
  if (factor.info() != Eigen::Success || !factor.isPositive()) return result;
  result.inverse = factor.solve(Matrix6::Identity());
  // Residuals of the scan's own fit: with another estimate of the pose, its error would repeat from scan to scan.
  const Vector6 fit = -result.inverse * gradient;
  for (const auto& [key, cube] : cubes) {
    const double scale = 1.0 / (1.0 / (kWellKnown_m * kWellKnown_m) + cube.weight.trace());
    const Vector3 residual = cube.residual + cube.coupling.transpose() * fit;
    result.cubes.push_back({key, scale * residual, scale * cube.weight, cube.coupling, scale * cube.coupling});
  }

  Matrix6x3 place = Matrix6x3::Zero();
  place.bottomRows<3>().setIdentity();
  const Key own_key = map_error_cube(T_map_seen.position, 0);
  for (int s = 0; s < kMapErrorScales; ++s) {
    std::map<Key, Matrix6x3> couplings;
    for (const CubeOffset& cube : result.cubes) {
      couplings.try_emplace(coarser(cube.cube, s), Matrix6x3::Zero()).first->second += cube.coupling;
    }
    const Key own_cube = coarser(own_key, s);
    if (s >= kFirstScaleOfPlaces) couplings.try_emplace(own_cube, Matrix6x3::Zero());
    Matrix6 from_place = Matrix6::Zero();
    Matrix6 from_rest = Matrix6::Zero();
    for (const auto& [key, coupling] : couplings) {
      const Matrix6x3 moved = result.inverse * coupling;
      const Matrix6x3 against = s >= kFirstScaleOfPlaces && key == own_cube ? Matrix6x3(moved - place) : moved;
      from_place += against * against.transpose();
      from_rest += moved * moved.transpose();
    }
    result.pose_covariance[static_cast<std::size_t>(s)] = symmetric(from_place);
    result.fit_covariance[static_cast<std::size_t>(s)] = symmetric(from_rest);
  }
  return result;
}

std::optional<MapErrorMoments> compare_map_errors(const MapError& a, const MapError& b) {
  std::array<std::map<Key, Joined>, kMapErrorScales> scales;
  std::size_t common = 0;
  auto other = b.cubes.begin();
  for (const CubeOffset& cube : a.cubes) {
    while (other != b.cubes.end() && other->cube < cube.cube) ++other;
    if (other == b.cubes.end()) break;
    if (other->cube != cube.cube) continue;
    ++common;
    for (int s = 0; s < kMapErrorScales; ++s) {
      Joined& joined = scales[static_cast<std::size_t>(s)][coarser(cube.cube, s)];
      joined.offset_m += cube.offset_m;
      joined.other_offset_m += other->offset_m;
      joined.gain += cube.gain;
      joined.other_gain += other->gain;
      joined.coupling += cube.coupling;
      joined.by_pose += cube.by_pose;
    }
  }
  if (common < kFewestCubes) return std::nullopt;

  MapErrorMoments result;
  for (int s = 0; s < kMapErrorScales; ++s) {  // of the moment
    const auto& own = scales[static_cast<std::size_t>(s)];
    Matrix6 by_pose = Matrix6::Zero();
    for (const auto& [key, joined] : own) {
      result.products_m2[s] += joined.offset_m.dot(joined.other_offset_m);
      by_pose += joined.by_pose * joined.by_pose.transpose();
    }
    for (int t = 0; t < kMapErrorScales; ++t) {  // of the displacement
      const auto& finer = scales[static_cast<std::size_t>(std::min(s, t))];
      const auto& displaced = scales[static_cast<std::size_t>(t)];
      double mixed = 0.0;
      double main = 0.0;
      double alone = 0.0;
      for (const auto& [key, joined] : finer) {
        main += joined.gain.cwiseProduct(joined.other_gain).sum();
        alone += joined.gain.squaredNorm();
        // What the pose takes up of a displacement of the cubes (docs/design/042).
        const Joined& moment = own.at(coarser(key, s - std::min(s, t)));
        const Joined& moved = displaced.at(coarser(key, t - std::min(s, t)));
        mixed += (moment.by_pose.transpose() * a.inverse * moved.coupling * joined.gain.transpose()).trace();
      }
      const double taken = (by_pose.cwiseProduct(a.fit_covariance[static_cast<std::size_t>(t)])).sum();
      const double left = alone > 0.0 ? (alone - 2.0 * mixed + taken) / alone : 1.0;
      result.gains(s, t) = main * std::clamp(left, kLeastLeft, 1.0);
    }
  }
  if (!(result.gains(0, 0) > 0.0)) return std::nullopt;
  return result;
}

MapErrorVariances MapErrorMoments::variances_m2() const {
  // As many rows as moments, each a mean product; and a weak belief in none, where the moments show nothing.
  constexpr double kBelief = 0.05;
  Eigen::Matrix<double, 2 * kMapErrorScales, kMapErrorScales> rows;
  Eigen::Matrix<double, 2 * kMapErrorScales, 1> wanted = Eigen::Matrix<double, 2 * kMapErrorScales, 1>::Zero();
  for (int s = 0; s < kMapErrorScales; ++s) {
    const double norm = gains.row(s).maxCoeff();
    if (!(norm > 0.0)) return MapErrorVariances::Zero();
    rows.row(s) = gains.row(s) / norm;
    wanted[s] = products_m2[s] / norm;
  }
  rows.bottomRows<kMapErrorScales>() = kBelief * Eigen::Matrix<double, kMapErrorScales, kMapErrorScales>::Identity();

  MapErrorVariances best = MapErrorVariances::Zero();
  double least = wanted.squaredNorm();
  for (int subset = 1; subset < 1 << kMapErrorScales; ++subset) {
    std::vector<int> used;
    for (int s = 0; s < kMapErrorScales; ++s) {
      if ((subset & (1 << s)) != 0) used.push_back(s);
    }
    const Eigen::MatrixXd part = rows(Eigen::all, used);
    const Eigen::VectorXd found = part.householderQr().solve(wanted);
    const double rest = (wanted - part * found).squaredNorm();
    if (found.minCoeff() < 0.0 || rest >= least) continue;
    least = rest;
    best.setZero();
    for (std::size_t i = 0; i < used.size(); ++i) best[used[i]] = found[static_cast<Eigen::Index>(i)];
  }
  return best;
}

double MapErrorMoments::finest_variance_m2() const {
  return gains(0, 0) > 0.0 ? std::max(0.0, products_m2[0] / gains(0, 0)) : 0.0;
}

}  // namespace lodestone

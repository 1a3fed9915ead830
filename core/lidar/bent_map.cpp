#include "core/lidar/bent_map.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <array>
#include <cmath>
#include <map>
#include <tuple>
#include <utility>

#include "core/lidar/condensed_cost.h"
#include "core/lidar/displacement_part.h"

namespace lodestone {

namespace {

/// A scan is displaced by regions: cells of eight cubes up to the first distance from the robot, of eight such cells up
/// to the second, of eight of those beyond. At a distance, a displacement differs anyway from the robot's.
constexpr std::array<double, 2> kRegionsUpTo_m{25.0, 60.0};

/// Mean square of the distances of points from the center of a square wall or floor of a cube.
constexpr double kSpreadOfCube_m2 = kMapErrorCube_m * kMapErrorCube_m / 6.0;

/// An axis of a region is displaced if that is more than this share of the variance of what the scan measures there.
constexpr double kLeastShare = 0.01;

/// Sigmas beyond which an axis of a region was moved.
constexpr double kContradicts = 3.0;
constexpr double kLeastExcess = 0.01;    // of the variance: less is rounding
constexpr double kLeastCompared = 0.01;  // share of an axis' information that the other axes can be compared with
constexpr int kPasses = 3;

constexpr double kLeastReal = 0.01;  // least share of the information that is not spurious: keeps the pose defined

/// Of a pose that a scan does not observe, and of a displacement that mostly errors of normals show.
constexpr double kUnknownTurn_rad = 0.1;  // sigma
constexpr double kUnknown_m2 = kUnknownPlace_m * kUnknownPlace_m;

struct Region {
  Matrix6x3 coupling = Matrix6x3::Zero();
  Matrix6x3 spurious = Matrix6x3::Zero();
  Vector3 residual = Vector3::Zero();
  Vector3 center = Vector3::Zero();
  double weights = 0.0;
  double spread_m2 = 0.0;               // mean square of its cubes' distances from the center
  double squared_weights = 0.0;         // of its cubes
  double apart_m2 = 0.0;                // variance of the mean, by what its cubes are displaced apart from each other
  Matrix6x3 taken = Matrix6x3::Zero();  // M

  Matrix3 weight() const { return coupling.bottomRows<3>(); }

  /// Share of the cubes' variance in the mean of several.
  double share_of_cubes() const { return squared_weights / (weights * weights); }
};

Matrix6 symmetric(const Matrix6& matrix) {
  return 0.5 * (matrix + matrix.transpose());
}

using RegionKey = std::pair<int, MapErrorCube>;

RegionKey region_key(const CubeSums& cube, const Vector3& position) {
  const double away_m = (cube.center - position).norm();
  RegionKey key{0, cell_of(cube.key)};
  for (const double limit_m : kRegionsUpTo_m) {
    if (away_m < limit_m) break;
    key = {key.first + 1, cell_of(key.second)};
  }
  return key;
}

/// The regions, and that of each cube.
std::pair<std::vector<Region>, std::vector<std::size_t>> regions_of(const ScanSums& scan, const Vector3& position) {
  std::map<RegionKey, std::size_t> places;
  std::vector<Region> regions;
  std::vector<std::size_t> region_of;
  for (const CubeSums& cube : scan.cubes) {
    const auto [found, added] = places.try_emplace(region_key(cube, position), regions.size());
    if (added) regions.emplace_back();
    region_of.push_back(found->second);
    Region& region = regions[found->second];
    region.coupling += cube.coupling;
    region.spurious += cube.spurious;
    region.residual += cube.residual;
    region.center += cube.weights * cube.center;
    region.weights += cube.weights;
    region.squared_weights += cube.weights * cube.weights;
  }
  for (Region& region : regions) region.center /= region.weights;
  for (std::size_t i = 0; i < scan.cubes.size(); ++i) {
    Region& region = regions[region_of[i]];
    region.spread_m2 += scan.cubes[i].weights / region.weights *
                        ((scan.cubes[i].center - region.center).squaredNorm() + kSpreadOfCube_m2);
  }
  return {std::move(regions), std::move(region_of)};
}

/// P with Pᵀ `all` P = `seen`, near the identity where they are alike.
Matrix6 share_of(const Matrix6& seen, const Matrix6& all) {
  const Eigen::GeneralizedSelfAdjointEigenSolver<Matrix6> pencil(seen, all);
  const Vector6 roots = pencil.eigenvalues().cwiseMax(0.0).cwiseMin(1.0).cwiseSqrt();
  return pencil.eigenvectors() * roots.asDiagonal() * pencil.eigenvectors().transpose() * all;
}

/// The generalized least squares of one scan: the displacement of each region is eliminated along the axes in which
/// the scan measures it, with λ the information there and R its covariance. M = B (Λ + R⁻¹)⁻¹ is what
/// displacements take from the pose. With D = Λ⁻¹, (Λ + R⁻¹)⁻¹ = D − D (R + D)⁻¹ D. What mostly errors
/// of normals show is an unknown displacement.
class BentMap {
 public:
  BentMap(const ScanSums& scan, const Vector3& position, const MapErrorVariances& variances_m2)
      : scan_(scan), cube_variance_m2_(variances_m2[0]) {
    std::tie(regions_, region_of_) = regions_of(scan, position);
    for (int part = 1; part < kMapErrorParts; ++part) {
      if (variances_m2[part] > 0.0) parts_.push_back({DisplacementPart(part, position), variances_m2[part]});
    }
    find_directions();
    sum_along_directions();
    eliminate_displacements();
    observe();
    for (int pass = 0; pass < kPasses && add_contradictions(); ++pass) {
      eliminate_displacements();
      observe();
    }
    find_errors();
  }

  Matrix6 seen_share() const { return share_of(seen_, all_); }

  /// Displacements of the scan's points: that of the region of each cube, and a motion (φ, p) of the whole scan, with
  /// which the least squares of all points gives `share` times the best pose.
  std::pair<std::vector<Vector3>, Vector6> displacement(const Matrix6& share) const;

  Matrix6 cube_covariance() const {
    Matrix6 result = Matrix6::Zero();
    for (const Matrix6x3& moved : moved_by_) result.noalias() += moved * moved.transpose();
    return result;
  }

  /// Of the cubes' displacements, which differ within a region.
  LongMapError long_error() const {
    const std::vector<DisplacedPlace> places = places_of_cubes();
    std::array<Matrix6, kMapErrorParts> covariances;
    covariances.fill(Matrix6::Zero());
    for (const Part& part : parts_) {
      covariances[static_cast<std::size_t>(part.displacement.part())] =
          part.variance_m2 * part.displacement.covariance_of_pose(places);
    }
    return sum_of_parts(covariances);
  }

 private:
  struct Part {
    DisplacementPart displacement;
    double variance_m2;
  };

  /// How each cube's displacement moves the pose; of cells, if there are many cubes.
  std::vector<DisplacedPlace> places_of_cubes() const {
    const bool many = scan_.cubes.size() > kManyCubes;
    std::map<MapErrorCube, DisplacedPlace> places;
    for (std::size_t i = 0; i < scan_.cubes.size(); ++i) {
      const CubeSums& cube = scan_.cubes[i];
      DisplacedPlace& place = places[many ? cell_of(cube.key) : cube.key];
      const Matrix6x3& moved = moved_by_[i];
      place.moved += moved;
      place.apart.noalias() += moved * moved.transpose();
      place.center += cube.weights * cube.center;
      place.weights += cube.weights;
    }
    for (auto& [key, place] : places) place.center /= place.weights;
    for (const CubeSums& cube : scan_.cubes) {
      DisplacedPlace& place = places.at(many ? cell_of(cube.key) : cube.key);
      place.spread_m2 += cube.weights / place.weights * ((cube.center - place.center).squaredNorm() + kSpreadOfCube_m2);
    }
    std::vector<DisplacedPlace> result;
    for (const auto& [key, place] : places) result.push_back(place);
    return result;
  }

  void find_directions() {
    std::vector<double> weights, moved_m2;
    for (std::size_t i = 0; i < regions_.size(); ++i) {
      Region& region = regions_[i];
      region.apart_m2 = cube_variance_m2_;
      for (const Part& part : parts_) {
        region.apart_m2 += part.variance_m2 * part.displacement.share_apart(region.spread_m2);
      }
      region.apart_m2 *= region.share_of_cubes();
      Eigen::SelfAdjointEigenSolver<Matrix3> eigen;
      eigen.computeDirect(region.weight());
      for (int k = 0; k < 3; ++k) {
        const DisplacedAxis direction{i, region.center, eigen.eigenvectors().col(k)};
        double variance_m2 = region.apart_m2;
        for (const Part& part : parts_) variance_m2 += part.variance_m2 * part.displacement.variance(direction);
        const double all = eigen.eigenvalues()[k];
        const double spurious = direction.axis.dot(region.spurious.bottomRows<3>() * direction.axis);
        const double real = all - kNormalNoiseMargin * spurious;
        if (!((real < 0.0 ? all * kUnknown_m2 : real * variance_m2) > kLeastShare)) continue;
        directions_.push_back(direction);
        weights.push_back(all);
        moved_m2.push_back(real < 0.0 ? kUnknown_m2 : 0.0);
      }
    }
    weight_ = Eigen::Map<const Eigen::VectorXd>(weights.data(), static_cast<Eigen::Index>(weights.size()));
    moved_m2_ = Eigen::Map<const Eigen::VectorXd>(moved_m2.data(), weight_.size());
  }

  /// What was moved since the survey contradicts everything else. With V = R + D, residuals e of the axes at the best
  /// pose, A = D B' and Q = V^-1 - V^-1 A H'^-1 A' V^-1, the residual of an axis relative to the others is
  /// (V^-1 e)_k / Q_kk, and its variance is 1 / Q_kk. An axis beyond kContradicts sigmas gets the variance that makes
  /// it kContradicts sigmas. A variance that was given is kept. Returns whether there is such an axis.
  bool add_contradictions() {
    const Eigen::Index count = weight_.size();
    if (count == 0) return false;
    const Eigen::VectorXd spread = weight_.cwiseInverse();
    const Eigen::VectorXd residual = spread.cwiseProduct(residual_ + coupling_.transpose() * sure_pose_);
    const Eigen::MatrixXd root = factor_.matrixL().solve(Eigen::MatrixXd::Identity(count, count));  // V^-1 = root' root
    const Eigen::VectorXd weighed = factor_.solve(residual);
    const Eigen::MatrixXd shown = factor_.solve(spread.asDiagonal() * coupling_.transpose());  // V^-1 A
    bool found = false;
    for (Eigen::Index k = 0; k < count; ++k) {
      const double alone = root.col(k).squaredNorm();
      const double information = alone - shown.row(k).dot(inverse_ * shown.row(k).transpose());
      if (!(information > kLeastCompared * alone)) continue;
      const double excess_m2 = std::pow(weighed[k] / (information * kContradicts), 2) - 1.0 / information;
      if (!(excess_m2 > kLeastExcess / information)) continue;
      moved_m2_[k] += excess_m2;
      found = true;
    }
    return found;
  }

  void sum_along_directions() {
    const auto count = static_cast<Eigen::Index>(directions_.size());
    coupling_.resize(6, count);
    residual_.resize(count);
    errors_ = Eigen::MatrixXd::Zero(count, count);
    for (Eigen::Index k = 0; const DisplacedAxis& direction : directions_) {
      const Region& region = regions_[direction.region];
      coupling_.col(k) = region.coupling * direction.axis;
      residual_[k] = region.residual.dot(direction.axis);
      errors_(k, k) = 1.0 / weight_[k] + region.apart_m2;
      ++k;
    }
    for (const Part& part : parts_) errors_ += part.variance_m2 * part.displacement.covariance(directions_);
  }

  void eliminate_displacements() {
    Eigen::MatrixXd sum = errors_;
    sum.diagonal() += moved_m2_;
    factor_.compute(sum);
    taken_ = eliminated(coupling_.transpose()).transpose();
    for (Region& region : regions_) region.taken.setZero();
    for (Eigen::Index k = 0; const DisplacedAxis& direction : directions_) {
      regions_[direction.region].taken.noalias() += taken_.col(k++) * direction.axis.transpose();
    }
  }

  /// (Λ + R⁻¹)⁻¹ times columns.
  Eigen::MatrixXd eliminated(const Eigen::MatrixXd& columns) const {
    if (columns.rows() == 0) return columns;
    const Eigen::MatrixXd scaled = weight_.cwiseInverse().asDiagonal() * columns;
    return scaled - weight_.cwiseInverse().asDiagonal() * factor_.solve(scaled);
  }

  /// What the scan observes of the pose, without the apparent information from errors of normals.
  void observe() {
    const Matrix6 taken = taken_ * coupling_.transpose();
    Matrix6 noise = scan_.information - taken - taken.transpose() + taken_ * weight_.asDiagonal() * taken_.transpose();
    const Eigen::MatrixXd left = coupling_ - taken_ * weight_.asDiagonal();  // of what a region alone is displaced by
    noise.noalias() += left * moved_m2_.asDiagonal() * left.transpose();
    Matrix6 reduced = scan_.information - taken;
    Matrix6 spurious = scan_.spurious;
    for (const Region& region : regions_) {
      const Matrix6 crossed = region.taken * region.spurious.transpose();
      spurious +=
          region.taken * region.spurious.bottomRows<3>() * region.taken.transpose() - crossed - crossed.transpose();
    }
    // Information that is added where the scan has none is spurious, too.
    Vector6 unknown;
    unknown << Vector3::Constant(1.0 / (kUnknownTurn_rad * kUnknownTurn_rad)), Vector3::Constant(1.0 / kUnknown_m2);
    noise.diagonal() += unknown;
    reduced.diagonal() += unknown;
    spurious.diagonal() += unknown;
    all_ = scan_.information;
    all_.diagonal() += 1e-9 * unknown;
    const Eigen::GeneralizedSelfAdjointEigenSolver<Matrix6> shares(symmetric(spurious), symmetric(reduced));
    const Matrix6& directions = shares.eigenvectors();  // Vᵀ H V = 1
    const Vector6 real = (1.0 - shares.eigenvalues().array()).max(kLeastReal).min(1.0);
    const auto inverse_of = [&](const Vector6& shown) {
      return Matrix6(directions * shown.cwiseInverse().asDiagonal() * directions.transpose());
    };
    const Eigen::LLT<Matrix6> variance(symmetric(directions.transpose() * noise * directions));
    const Matrix6 dual = symmetric(reduced) * directions;
    const Matrix6 scaled = dual * real.asDiagonal();
    seen_ = symmetric(scaled * variance.solve(scaled.transpose()));
    const Vector6 gradient = scan_.gradient - taken_ * residual_;
    pose_ = -inverse_of(real) * gradient;
    // Where most of the information is spurious, the pose is too uncertain for displacements.
    inverse_ = inverse_of(real.cwiseMax(1.0 / kNormalNoiseMargin));
    sure_pose_ = -inverse_ * gradient;
  }

  void find_errors() {
    for (std::size_t i = 0; i < scan_.cubes.size(); ++i) {
      const CubeSums& cube = scan_.cubes[i];
      const Matrix3 weight = cube.weight - cube.spurious.bottomRows<3>();
      moved_by_.emplace_back(inverse_ * (cube.coupling - cube.spurious - regions_[region_of_[i]].taken * weight));
    }
  }

  const ScanSums& scan_;
  double cube_variance_m2_;
  std::vector<Region> regions_;
  std::vector<std::size_t> region_of_;  // of each cube
  std::vector<Part> parts_;
  std::vector<DisplacedAxis> directions_;
  Eigen::VectorXd weight_;               // Λ
  Eigen::VectorXd moved_m2_;             // variances of what contradicts all else, or is unknown
  Eigen::MatrixXd errors_;               // R + D, without moved_m2_
  Eigen::MatrixXd coupling_;             // B
  Eigen::MatrixXd taken_;                // M
  Eigen::VectorXd residual_;             // Σ w n r along the directions
  Eigen::LLT<Eigen::MatrixXd> factor_;   // of R + D, with moved_m2_
  Matrix6 all_ = Matrix6::Zero();        // of the pose, without displacements
  Matrix6 inverse_ = Matrix6::Zero();    // of the information with them
  Matrix6 seen_ = Matrix6::Zero();       // inverse covariance of the best pose by the noise of the points
  Vector6 pose_ = Vector6::Zero();       // the best
  std::vector<Matrix6x3> moved_by_;      // how a cube's displacement moves the pose
  Vector6 sure_pose_ = Vector6::Zero();  // in directions that the scan observes
};

std::pair<std::vector<Vector3>, Vector6> BentMap::displacement(const Matrix6& share) const {
  const Eigen::VectorXd along = -eliminated(residual_ + coupling_.transpose() * sure_pose_);
  std::vector<Vector3> of_regions(regions_.size(), Vector3::Zero());
  for (std::size_t k = 0; k < directions_.size(); ++k) {
    if (moved_m2_[static_cast<Eigen::Index>(k)] >= kUnknown_m2) continue;  // its points are left as they are
    of_regions[directions_[k].region] += along[static_cast<Eigen::Index>(k)] * directions_[k].axis;
  }
  std::vector<Vector3> result;
  Vector6 gradient = scan_.gradient;
  for (std::size_t i = 0; i < scan_.cubes.size(); ++i) {
    result.push_back(of_regions[region_of_[i]]);
    gradient += scan_.cubes[i].coupling * result.back();
  }
  return {result, -all_.llt().solve(gradient) - share * pose_};
}

}  // namespace

LongMapError sum_of_parts(const std::array<Matrix6, kMapErrorParts>& covariances) {
  LongMapError result;
  double sum_m2 = 0.0;
  double weighed_m3 = 0.0;
  for (int part = 1; part < kMapErrorParts; ++part) {
    const Matrix6& covariance = covariances[static_cast<std::size_t>(part)];
    result.covariance += covariance;
    const double own_m2 = covariance.bottomRightCorner<3, 3>().trace();
    sum_m2 += own_m2;
    weighed_m3 += own_m2 * map_error_length_m(part);
  }
  if (sum_m2 > 0.0) result.length_m = weighed_m3 / sum_m2;
  return result;
}

Matrix6 pose_error_root(const Matrix6& covariance) {
  constexpr double kLeast = 1e-6;
  const Eigen::LLT<Matrix6> root(covariance + kLeast * kLeast * Matrix6::Identity());
  if (root.info() != Eigen::Success) return kLeast * Matrix6::Identity();
  return root.matrixL();
}

BentMapFit fit_in_bent_map(std::span<const Correspondence> correspondences, const Pose& T_map_imu,
                           const MapErrorVariances& variances_m2) {
  BentMapFit result;
  result.straightened.assign(correspondences.begin(), correspondences.end());
  if (correspondences.empty()) return result;
  const ScanSums scan = sum_by_cubes(correspondences, T_map_imu, true);
  const BentMap map(scan, T_map_imu.position, variances_m2);
  const Matrix6 share = map.seen_share();
  const auto [displacements, motion] = map.displacement(share);
  const Matrix3 rotation = T_map_imu.rotation.toRotationMatrix();
  for (std::size_t i = 0; i < correspondences.size(); ++i) {
    Eigen::Vector3f& point = result.straightened[i].point;
    const Vector3 arm = rotation * point.cast<double>();
    const Vector3 moved = displacements[scan.cube_of[i]] + motion.head<3>().cross(arm) + motion.tail<3>();
    point += (rotation.transpose() * moved).cast<float>();
  }
  Matrix6 to_imu = Matrix6::Identity();
  to_imu.topLeftCorner<3, 3>() = rotation.transpose();
  result.seen_share = to_imu * share * to_imu.transpose();
  result.cube_covariance = map.cube_covariance();
  result.long_error = map.long_error();
  return result;
}

}  // namespace lodestone

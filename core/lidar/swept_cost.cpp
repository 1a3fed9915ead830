#include "core/lidar/swept_cost.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/imu/hermite.h"
#include "core/lidar/moment_products.h"
#include "core/lidar/prefetch_plane.h"
#include "core/parallel.h"

namespace lodestone {

namespace {

// Sigmas about the pose that a step begins at: keep it defined along what a scan does not observe.
constexpr double kLooseTurn_rad = 0.1;
constexpr double kLoosePlace_m = 1.0;

constexpr int kSweepChunks = 16;
constexpr int kBins = 64;  // of a step: points of a bin share their age
// A dense scan determines its end from the last few milliseconds. There, omitted modes would count as information.
constexpr int kTurnModes = 8;
constexpr int kShiftModes = 6;
constexpr int kStates = 4;  // groups of three: turn, slope at the end, shift and slope at the beginning
constexpr int kGroups = kStates + kTurnModes + kShiftModes;
constexpr int kSwept = 3 * kGroups;
constexpr int kNoise = 3 * (kTurnModes + kShiftModes);

// Roots of cos β cosh β = 1: the modes of the integrated bridge are those of a beam clamped at both ends.
constexpr std::array<double, kShiftModes> kClamped{4.730040744862704,  7.853204624095838,  10.995607838001671,
                                                   14.137165491257464, 17.278759657399480, 20.420352245626060};

struct Bin {
  MomentProducts products;
  double weight_sum = 0.0;
  double weighted_share = 0.0;
};

using Bins = std::array<Bin, kBins>;

void accumulate(std::span<const Correspondence> part, const CondensedCost& cost, double step_s, Bins& bins) {
  for (std::size_t i = 0; i < part.size(); ++i) {
    prefetch_plane(part, i);
    const Correspondence& match = part[i];
    const Vector3 n = match.plane->normal.cast<double>();
    const double w = static_cast<double>(match.weight());
    const double share = std::clamp(static_cast<double>(match.age_s) / step_s, 0.0, 1.0);
    Bin& bin = bins[static_cast<std::size_t>(std::min(kBins - 1, static_cast<int>(share * kBins)))];
    bin.products.add(n, match.point.cast<double>() - cost.centroid,
                     n.dot(cost.anchor - match.plane->center.cast<double>()), w);
    bin.weight_sum += w;
    bin.weighted_share += w * share;
  }
}

/// A mode of the clamped beam, of unit mean square. Source: texts on vibration, e.g. Blevins 1979, table 8-1.
double clamped_mode(double beta, double share) {
  const double sigma = (std::cosh(beta) - std::cos(beta)) / (std::sinh(beta) - std::sin(beta));
  const double x = beta * share;
  return std::cosh(x) - std::cos(x) - sigma * (std::sinh(x) - std::sin(x));
}

/// The factor of each group of three at a share of the step.
std::array<double, kGroups> functions_at(double share, double step_s) {
  std::array<double, kGroups> result{};
  const Hermite basis(share * step_s, step_s);
  result[0] = basis.share;
  result[1] = basis.near_slope;
  result[2] = basis.far_position;
  result[3] = basis.far_slope;
  for (int mode = 0; mode < kTurnModes; ++mode) {
    result[static_cast<std::size_t>(kStates + mode)] = M_SQRT2 * std::sin((mode + 1) * M_PI * share);
  }
  for (int mode = 0; mode < kShiftModes; ++mode) {
    result[static_cast<std::size_t>(kStates + kTurnModes + mode)] =
        clamped_mode(kClamped[static_cast<std::size_t>(mode)], share);
  }
  return result;
}

constexpr bool turns(int group) {
  return group == 0 || (group >= kStates && group < kStates + kTurnModes);
}

/// Rows [(p − c) × Rᵀn; n] of a point, as linear functions of its row a of ξ. `lever`: from c, the position of the imu,
/// to the scan's centroid.
Eigen::Matrix<double, 6, 13> motion_rows(const Matrix3& rotation, const Vector3& lever) {
  Eigen::Matrix<double, 6, 13> result = Eigen::Matrix<double, 6, 13>::Zero();
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3;
    const int k = (i + 2) % 3;
    result.block<1, 3>(i, 3 * j) = rotation.col(k).transpose();
    result.block<1, 3>(i, 3 * k) = -rotation.col(j).transpose();
  }
  result.block<3, 3>(0, 9) = so3::hat(lever) * rotation.transpose();
  result.block<3, 3>(3, 9).setIdentity();
  return result;
}

/// Marginalizes the last variables of `moment`; `information` is their prior.
template <int kept, class Matrix>
Eigen::Matrix<double, kept, kept> marginal(const Matrix& moment, const Eigen::MatrixXd& information) {
  const Eigen::Index marginalized = moment.rows() - kept;
  const Eigen::LLT<Eigen::MatrixXd> root(moment.bottomRightCorner(marginalized, marginalized) + information);
  const Eigen::MatrixXd border = root.matrixL().solve(moment.bottomLeftCorner(marginalized, kept));
  Eigen::Matrix<double, kept, kept> result = moment.template topLeftCorner<kept, kept>();
  result.noalias() -= border.transpose() * border;
  return result;
}

/// Without a state before the step, the departure is the noise of the IMU over the whole step, backwards from the end,
/// and the constant errors of rate and acceleration.
Matrix25 without_state_before(const Matrix25& given_both, const Deskewing& deskewing) {
  const double step_s = deskewing.step_s;
  // y = G [ξ, slope at the end; turn, noise of shift, noise of slope].
  Matrix25 order = Matrix25::Zero();
  order.topLeftCorner<13, 13>().setIdentity();
  order.block<3, 3>(16, 13).setIdentity();
  order.block<3, 3>(13, 16).setIdentity();
  order.block<3, 3>(19, 19).setIdentity();
  order.block<3, 3>(22, 22).setIdentity();
  order.block<3, 3>(19, 13) = step_s * Matrix3::Identity();
  order.block<3, 3>(22, 13).setIdentity();
  const Eigen::Matrix<double, 16, 16> rest =
      marginal<16>(Matrix25(order.transpose() * given_both * order), step_information(deskewing));
  Matrix25 result = Matrix25::Zero();
  result.topLeftCorner<13, 13>() = rest.topLeftCorner<13, 13>();
  result.block<13, 3>(0, 16) = rest.block<13, 3>(0, 13);
  result.block<3, 13>(16, 0) = rest.block<3, 13>(13, 0);
  result.block<3, 3>(16, 16) = rest.block<3, 3>(13, 13);
  return result;
}

/// The moment if the departure has an error as well: shift and turn as large as those of the pose, slopes of twice the
/// shift a step.
Matrix25 with_departure_error(const Matrix25& moment, const Matrix6& pose_covariance, const Matrix3& rotation,
                              double step_s) {
  if (pose_covariance.isZero(0.0)) return moment;
  const auto root = [](const Matrix3& covariance) -> Matrix3 {
    const Eigen::SelfAdjointEigenSolver<Matrix3> solver(covariance);
    return solver.eigenvectors() * solver.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal();
  };
  const Matrix3 shift = root(pose_covariance.bottomRightCorner<3, 3>());
  Matrix12 error = Matrix12::Zero();
  error.block<3, 3>(0, 0) = rotation.transpose() * root(pose_covariance.topLeftCorner<3, 3>());
  error.block<3, 3>(3, 3) = 2.0 / step_s * shift;
  error.block<3, 3>(6, 6) = shift;
  error.block<3, 3>(9, 9) = 2.0 / step_s * shift;
  const Eigen::Matrix<double, 25, 12> border = moment.rightCols<12>() * error;
  const Matrix12 inner = Matrix12::Identity() + error.transpose() * border.bottomRows<12>();
  return moment - border * inner.llt().solve(border.transpose());
}

/// Gauss-Newton step to the pose at which the cost is least.
Vector6 step_to_least(const CondensedCost& cost, const Pose& T_map_imu) {
  Matrix6 information = cost.hessian(T_map_imu);
  information.diagonal().head<3>().array() += 1.0 / (kLooseTurn_rad * kLooseTurn_rad);
  information.diagonal().tail<3>().array() += 1.0 / (kLoosePlace_m * kLoosePlace_m);
  return -information.llt().solve(cost.gradient(T_map_imu));
}

/// `moment` moved rigidly in the map, such that without a departure it is least where `wanted` is. `cost`: of the scan.
Matrix25 with_least_pose_of(const Matrix25& wanted, const Matrix25& moment, CondensedCost cost, const Pose& T_map_imu) {
  cost.moment = wanted.topLeftCorner<13, 13>();
  const Pose there = T_map_imu.boxplus(step_to_least(cost, T_map_imu));
  cost.moment = moment.topLeftCorner<13, 13>();
  const Vector6 away = step_to_least(cost, there);
  const Pose move = there.boxplus(away) * there.inverse();
  // ξ(move · x) = `by_move` ξ(x).
  Matrix25 by_move = Matrix25::Identity();
  for (int i = 0; i < 12; i += 3) by_move.block<3, 3>(i, i) = move.rotation.toRotationMatrix();
  by_move.block<3, 1>(9, 12) = move * cost.anchor - cost.anchor;
  return by_move.transpose() * moment * by_move;
}

}  // namespace

SweptCost sweep(const CondensedCost& cost, std::span<const Correspondence> correspondences, const Pose& T_map_imu,
                const Deskewing& deskewing, const SharedMapError& map_error) {
  SweptCost result;
  result.given_both.topLeftCorner<13, 13>() = cost.moment;
  result.given_end = result.given_both;
  const double step_s = deskewing.step_s;
  if (step_s <= 0.0 || correspondences.empty()) return result;

  std::vector<Bins> parts(kSweepChunks);
  const std::size_t size = (correspondences.size() + kSweepChunks - 1) / kSweepChunks;
  parallel_for(0, kSweepChunks, [&](int i) {
    const std::size_t begin = std::min(correspondences.size(), size * static_cast<std::size_t>(i));
    const std::size_t end = std::min(correspondences.size(), begin + size);
    accumulate(correspondences.subspan(begin, end - begin), cost, step_s, parts[static_cast<std::size_t>(i)]);
  });

  const Matrix3 rotation = T_map_imu.rotation.toRotationMatrix();
  // [ξ; departure; modes]
  constexpr int kAll = 13 + kSwept;
  Eigen::Matrix<double, kAll, kAll> all = Eigen::Matrix<double, kAll, kAll>::Zero();
  for (int b = 0; b < kBins; ++b) {
    Bin bin = parts.front()[static_cast<std::size_t>(b)];
    for (std::size_t i = 1; i < parts.size(); ++i) {
      const Bin& other = parts[i][static_cast<std::size_t>(b)];
      if (other.weight_sum <= 0.0) continue;
      bin.products += other.products;
      bin.weight_sum += other.weight_sum;
      bin.weighted_share += other.weighted_share;
    }
    if (bin.weight_sum <= 0.0) continue;
    const double share = bin.weighted_share / bin.weight_sum;
    const Hermite basis(share * step_s, step_s);
    const Vector3 position = basis.far_position * deskewing.before_position - basis.near_slope * deskewing.velocity -
                             basis.far_slope * deskewing.before_velocity;
    const Eigen::Matrix<double, 6, 13> rows = motion_rows(rotation, cost.centroid - position);
    const Matrix13 moment = bin.products.moment();
    const Eigen::Matrix<double, 6, 13> border = rows * moment;
    const Matrix6 own = border * rows.transpose();
    const std::array<double, kGroups> functions = functions_at(share, step_s);
    all.topLeftCorner<13, 13>() += moment;
    for (int i = 0; i < kGroups; ++i) {
      const double f = functions[static_cast<std::size_t>(i)];
      const int from = turns(i) ? 0 : 3;
      all.block<3, 13>(13 + 3 * i, 0) += f * border.middleRows<3>(from);
      for (int j = 0; j <= i; ++j) {
        all.block<3, 3>(13 + 3 * i, 13 + 3 * j) +=
            (f * functions[static_cast<std::size_t>(j)]) * own.block<3, 3>(from, turns(j) ? 0 : 3);
      }
    }
  }
  all.triangularView<Eigen::StrictlyUpper>() = all.transpose();

  Eigen::VectorXd information(kNoise);
  for (int mode = 0; mode < kTurnModes; ++mode) {
    const double variance = deskewing.gyroscope_density * step_s / std::pow((mode + 1) * M_PI, 2);
    information.segment<3>(3 * mode).setConstant(1.0 / variance);
  }
  for (int mode = 0; mode < kShiftModes; ++mode) {
    const double variance =
        deskewing.accelerometer_density * std::pow(step_s, 3) / std::pow(kClamped[static_cast<std::size_t>(mode)], 4);
    information.segment<3>(3 * (kTurnModes + mode)).setConstant(1.0 / variance);
  }
  const Matrix25 exact = marginal<25>(all, information.asDiagonal());
  result.given_both = with_departure_error(exact, map_error.pose_covariance, rotation, step_s);
  if (map_error.straightened) result.given_both = with_least_pose_of(exact, result.given_both, cost, T_map_imu);
  result.given_end = without_state_before(result.given_both, deskewing);
  return result;
}

Eigen::Matrix<double, 9, 9> step_information(const Deskewing& deskewing) {
  const double step_s = deskewing.step_s;
  Eigen::Matrix2d covariance;
  covariance << std::pow(step_s, 3) / 3.0, step_s * step_s / 2.0, step_s * step_s / 2.0, step_s;
  covariance *= deskewing.accelerometer_density;
  const Eigen::Vector2d by_acceleration(step_s * step_s / 2.0, step_s);
  covariance += deskewing.acceleration_variance * by_acceleration * by_acceleration.transpose();
  const Eigen::Matrix2d known = covariance.inverse();
  const double turn_variance =
      deskewing.gyroscope_density * step_s + deskewing.gyroscope_bias_variance * step_s * step_s;
  Eigen::Matrix<double, 9, 9> information = Eigen::Matrix<double, 9, 9>::Zero();
  information.topLeftCorner<3, 3>() = Matrix3::Identity() / turn_variance;
  for (int i = 0; i < 2; ++i) {
    for (int j = 0; j < 2; ++j) information.block<3, 3>(3 + 3 * i, 3 + 3 * j) = known(i, j) * Matrix3::Identity();
  }
  return information;
}

CondensedScan condense_scan(std::span<const Correspondence> correspondences, const Pose& T_map_imu,
                            const Deskewing& deskewing, const SharedMapError& map_error) {
  CondensedScan result;
  result.cost = condense(correspondences, T_map_imu);
  result.swept = sweep(result.cost, correspondences, T_map_imu, deskewing, map_error);
  result.deskewing = deskewing;
  return result;
}

}  // namespace lodestone

#include "core/lidar/swept_cost.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <vector>

#include "core/parallel.h"

namespace lodestone {

namespace {

constexpr int kSweepChunks = 16;
// Of the bridge. A scan that knows its pose to 0.01 mrad tells its end's from the last few milliseconds, and modes left out are
// taken for knowledge (docs/architecture.md has figures for three).
constexpr int kModes = 8;
constexpr int kSwept = 6 + 3 * kModes;  // rates, then three axes a mode
constexpr int kRows = 64;               // correspondences multiplied at a time

using SweptColumns = Eigen::Matrix<double, kSwept, kSwept>;
using SweptBorder = Eigen::Matrix<double, 13, kSwept>;

struct SweepSums {
  SweptColumns own = SweptColumns::Zero();
  SweptBorder border = SweptBorder::Zero();
};

/// A row a correspondence: what it says of ξ, and of what deskewing took wrongly.
struct SweepRows {
  Eigen::Matrix<double, kRows, 13> condensed;
  Eigen::Matrix<double, kRows, kSwept> swept;
  Eigen::Matrix<double, kRows, kSwept> weighted;
};

void fill(SweepRows& rows, int row, const Correspondence& match, const CondensedCost& cost, const Matrix3& map_to_imu,
          double step_s) {
  const Vector3 n = match.plane->normal.cast<double>();
  const Vector3 point = match.point.cast<double>();
  const Vector3 p = point - cost.centroid;
  const double age_s = static_cast<double>(match.age_s);
  const double share = std::min(std::max(age_s / step_s, 0.0), 1.0);
  const Eigen::RowVector3d turning = point.cross(map_to_imu * n).transpose();
  rows.condensed.row(row) << p.x() * n.transpose(), p.y() * n.transpose(), p.z() * n.transpose(), n.transpose(),
      n.dot(cost.anchor - match.plane->center.cast<double>());
  rows.swept.row(row).head<3>() = age_s * turning;
  rows.swept.row(row).segment<3>(3) = age_s * n.transpose();
  // sin(kx) by its recurrence: one sine and one cosine a point.
  const double twice_cosine = 2.0 * std::cos(M_PI * share);
  double before = 0.0;
  double sine = std::sin(M_PI * share);
  for (int mode = 0; mode < kModes; ++mode) {
    rows.swept.row(row).segment<3>(6 + 3 * mode) = (M_SQRT2 * sine) * turning;
    const double next = twice_cosine * sine - before;
    before = sine;
    sine = next;
  }
  rows.weighted.row(row) = static_cast<double>(match.weight()) * rows.swept.row(row);
}

void accumulate(std::span<const Correspondence> part, const CondensedCost& cost, const Matrix3& map_to_imu, double step_s,
                SweepSums& sums) {
  SweepRows rows;
  for (std::size_t first = 0; first < part.size(); first += kRows) {
    const int count = static_cast<int>(std::min<std::size_t>(kRows, part.size() - first));
    for (int row = 0; row < count; ++row) {
      fill(rows, row, part[first + static_cast<std::size_t>(row)], cost, map_to_imu, step_s);
    }
    sums.border.noalias() += rows.condensed.topRows(count).transpose() * rows.weighted.topRows(count);
    sums.own.noalias() += rows.swept.topRows(count).transpose() * rows.weighted.topRows(count);
  }
}

/// Marginalizes the last variables of `moment`, known to `information` each.
template <int kept, class Matrix>
Eigen::Matrix<double, kept, kept> marginal(const Matrix& moment, const Eigen::VectorXd& information) {
  const Eigen::Index gone = moment.rows() - kept;
  Eigen::MatrixXd own = moment.bottomRightCorner(gone, gone);
  own.diagonal() += information;
  const Eigen::LLT<Eigen::MatrixXd> root(own);
  const Eigen::MatrixXd border = root.matrixL().solve(moment.bottomLeftCorner(gone, kept));
  Eigen::Matrix<double, kept, kept> result = moment.template topLeftCorner<kept, kept>();
  result.noalias() -= border.transpose() * border;
  return result;
}

}  // namespace

SweptCost sweep(const CondensedCost& cost, std::span<const Correspondence> correspondences, const Pose& T_map_imu,
                const Deskewing& deskewing) {
  SweptCost result;
  result.given_both.topLeftCorner<13, 13>() = cost.moment;
  result.given_end = result.given_both;
  if (deskewing.step_s <= 0.0 || correspondences.empty()) return result;

  const Matrix3 map_to_imu = T_map_imu.rotation.toRotationMatrix().transpose();
  std::vector<SweepSums> parts(kSweepChunks);  // too large for a stack on which others may wait
  const std::size_t size = (correspondences.size() + kSweepChunks - 1) / kSweepChunks;
  parallel_for(0, kSweepChunks, [&](int i) {
    const std::size_t begin = std::min(correspondences.size(), size * static_cast<std::size_t>(i));
    const std::size_t end = std::min(correspondences.size(), begin + size);
    accumulate(correspondences.subspan(begin, end - begin), cost, map_to_imu, deskewing.step_s,
               parts[static_cast<std::size_t>(i)]);
  });
  SweepSums sum;
  for (const SweepSums& part : parts) {
    sum.own += part.own;
    sum.border += part.border;
  }

  // [ξ, rates, modes of the bridge, a shift of all points]
  constexpr int kAll = 13 + kSwept + 3;
  Eigen::Matrix<double, kAll, kAll> all = Eigen::Matrix<double, kAll, kAll>::Zero();
  all.topLeftCorner<13, 13>() = cost.moment;
  all.block<13, kSwept>(0, 13) = sum.border;
  all.block<kSwept, kSwept>(13, 13) = sum.own;
  all.block<kSwept, 13>(13, 0) = sum.border.transpose();
  // A shift moves residuals as the position in ξ does.
  all.bottomRows<3>() = all.middleRows<3>(9).eval();
  all.rightCols<3>() = all.middleCols<3>(9).eval();

  Eigen::VectorXd information(3 * kModes + 3);
  for (int mode = 0; mode < kModes; ++mode) {
    const double variance = deskewing.gyroscope_density * deskewing.step_s / std::pow((mode + 1) * M_PI, 2);
    information.segment<3>(3 * mode).setConstant(1.0 / variance);
  }
  // The scan's mean of noise integrated twice, back from the end.
  information.tail<3>().setConstant(20.0 / (deskewing.accelerometer_density * std::pow(deskewing.step_s, 3)));
  result.given_both = marginal<19>(all, information);

  // The turning rate last: its noise alone is then what is known of it.
  Matrix19 turned = result.given_both;
  turned.middleRows<3>(13).swap(turned.bottomRows<3>());
  turned.middleCols<3>(13).swap(turned.rightCols<3>());
  const Vector3 rate_information = Vector3::Constant(deskewing.step_s / deskewing.gyroscope_density);
  const Eigen::Matrix<double, 16, 16> rest = marginal<16>(turned, rate_information);
  result.given_end.setZero();
  result.given_end.topLeftCorner<13, 13>() = rest.topLeftCorner<13, 13>();
  result.given_end.block<13, 3>(0, 16) = rest.block<13, 3>(0, 13);
  result.given_end.block<3, 13>(16, 0) = rest.block<3, 13>(13, 0);
  result.given_end.block<3, 3>(16, 16) = rest.block<3, 3>(13, 13);
  return result;
}

CondensedScan condense_scan(std::span<const Correspondence> correspondences, const Pose& T_map_imu,
                            const Deskewing& deskewing) {
  CondensedScan result;
  result.cost = condense(correspondences, T_map_imu);
  result.swept = sweep(result.cost, correspondences, T_map_imu, deskewing);
  result.deskewing = deskewing;
  return result;
}

}  // namespace lodestone

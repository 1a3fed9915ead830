#include "core/registration/swept_cost.h"

#include <Eigen/Cholesky>
#include <array>
#include <cmath>

#include "core/parallel.h"

namespace lodestone {

namespace {

constexpr int kSweepChunks = 16;
constexpr int kModes = 3;  // of the bridge: five sixths of its variance; what is left changes its sign within a scan
constexpr int kSwept = 6 + 3 * kModes;  // rates, then three axes a mode

using SweptColumns = Eigen::Matrix<double, kSwept, kSwept>;
using SweptBorder = Eigen::Matrix<double, 13, kSwept>;

struct SweepSums {
  SweptColumns own = SweptColumns::Zero();
  SweptBorder border = SweptBorder::Zero();
};

void accumulate(std::span<const Correspondence> part, const CondensedCost& cost, const Matrix3& map_to_imu, double step_s,
                SweepSums& sums) {
  for (const Correspondence& match : part) {
    const Vector3 n = match.plane->normal.cast<double>();
    const Vector3 point = match.point.cast<double>();
    const Vector3 p = point - cost.centroid;
    const double w = static_cast<double>(match.weight());
    const double age_s = static_cast<double>(match.age_s);
    const double share = std::min(std::max(age_s / step_s, 0.0), 1.0);
    const Vector3 turning = point.cross(map_to_imu * n);
    Eigen::Matrix<double, kSwept, 1> swept;
    swept.head<3>() = age_s * turning;
    swept.segment<3>(3) = age_s * n;
    for (int mode = 0; mode < kModes; ++mode) {
      swept.segment<3>(6 + 3 * mode) = (M_SQRT2 * std::sin((mode + 1) * M_PI * share)) * turning;
    }
    Vector13 a;
    a << p.x() * n, p.y() * n, p.z() * n, n, n.dot(cost.anchor - match.plane->center.cast<double>());
    const Eigen::Matrix<double, kSwept, 1> weighted = w * swept;
    sums.border.noalias() += a * weighted.transpose();
    sums.own.noalias() += swept * weighted.transpose();
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
  std::array<SweepSums, kSweepChunks> parts;
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

#include "core/observability/window_information.h"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

namespace lodestone {

namespace {

constexpr int kState = 15;
constexpr int kMessage = 17;

// Rows of a square-root information matrix; columns: a state's 15 and gravity's 2, or several states' in a row. At most
// two messages and a pose's own rows, or a message and a link between two states: no memory is allocated.
using Rows =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, 2 * kMessage + 6, kState + kMessage>;

// Columns are scaled by the plausible initial sigma of each variable, so a pivot is the ratio of this sigma to the
// measured one. A smaller pivot counts as no information about its variable.
constexpr double kSmallestPivot = 1e-6;

Eigen::Matrix<double, kMessage, 1> column_scale() {
  Eigen::Matrix<double, kMessage, 1> scale;
  scale.segment<3>(tangent::rotation).setConstant(1e-1);
  scale.segment<3>(tangent::position).setConstant(1.0);
  scale.segment<3>(tangent::velocity).setConstant(1.0);
  scale.segment<3>(tangent::gyroscope_bias).setConstant(1e-2);
  scale.segment<3>(tangent::accelerometer_bias).setConstant(1e-1);
  scale.tail<2>().setConstant(1e-1);
  return scale;
}

/// Marginalizes the first `count` columns and returns the rows on the others.
Rows eliminate(const Rows& rows, int count) {
  const Eigen::Index others = rows.cols() - count;
  if (rows.rows() == 0) return Rows(0, others);
  Eigen::ColPivHouseholderQR<Rows> factor(rows.leftCols(count));
  Eigen::Index rank = 0;
  const Eigen::Index diagonal = std::min<Eigen::Index>(count, rows.rows());
  while (rank < diagonal && std::abs(factor.matrixQR()(rank, rank)) > kSmallestPivot) ++rank;
  Rows rest = rows.rightCols(others);
  rest.applyOnTheLeft(factor.householderQ().adjoint());
  return rest.bottomRows(rows.rows() - rank);
}

/// The same information in at most as many rows as columns.
Rows compress(const Rows& rows) {
  if (rows.rows() <= rows.cols()) return rows;
  Eigen::HouseholderQR<Rows> factor(rows);
  return factor.matrixQR().topRows(rows.cols()).triangularView<Eigen::Upper>();
}

/// Square root of the positive part of a 6×6 information, on the columns of a message.
Rows pose_rows(const Matrix6& information) {
  const Eigen::SelfAdjointEigenSolver<Matrix6> solver(0.5 * (information + information.transpose()));
  Rows rows = Rows::Zero(6, kMessage);
  rows.leftCols<6>() = solver.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal() * solver.eigenvectors().transpose();
  return rows * column_scale().asDiagonal();
}

Rows stack(const Rows& upper, const Rows& lower) {
  Rows rows(upper.rows() + lower.rows(), upper.cols());
  rows << upper, lower;
  return rows;
}

/// Carries a message over a link, forwards (from its first state to its second) or backwards.
Rows carry(const Rows& message, const ChainLink& link, bool forwards) {
  const Eigen::Matrix<double, kMessage, 1> scale = column_scale();
  const Matrix15& from = forwards ? link.by_first : link.by_second;
  const Matrix15& to = forwards ? link.by_second : link.by_first;
  Rows rows = Rows::Zero(message.rows() + kState, kState + kMessage);
  rows.topLeftCorner(message.rows(), kState) = message.leftCols(kState);
  rows.topRightCorner(message.rows(), 2) = message.rightCols(2);
  rows.bottomLeftCorner(kState, kState) = from * scale.head<kState>().asDiagonal();
  rows.block(message.rows(), kState, kState, kState) = to * scale.head<kState>().asDiagonal();
  rows.bottomRightCorner(kState, 2) = link.by_gravity * scale.tail<2>().asDiagonal();
  return compress(eliminate(rows, kState));
}

Matrix6 pose_marginal(const Rows& message) {
  Rows reordered(message.rows(), kMessage);
  reordered << message.rightCols(kMessage - 6), message.leftCols(6);
  const Rows rows = eliminate(reordered, kMessage - 6);
  const Vector6 inverse_scale = column_scale().head<6>().cwiseInverse();
  const Matrix6 information = rows.transpose() * rows;
  return inverse_scale.asDiagonal() * information * inverse_scale.asDiagonal();
}

}  // namespace

Matrix6 marginal_pose_information(std::span<const Matrix6> pose_information, std::span<const ChainLink> links,
                                  std::size_t k) {
  Rows forward(0, kMessage);
  for (std::size_t i = 0; i < k; ++i) {
    forward = carry(compress(stack(forward, pose_rows(pose_information[i]))), links[i], true);
  }
  Rows backward(0, kMessage);
  for (std::size_t i = pose_information.size() - 1; i > k; --i) {
    backward = carry(compress(stack(backward, pose_rows(pose_information[i]))), links[i - 1], false);
  }
  return pose_marginal(compress(stack(stack(forward, pose_rows(pose_information[k])), backward)));
}

}  // namespace lodestone

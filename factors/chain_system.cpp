#include "factors/chain_system.h"

#include <Eigen/Cholesky>
#include <algorithm>

#include "factors/chain_kernels.h"

namespace lodestone {

namespace {

constexpr int kState = ChainSystem::kState;
using Strided = Eigen::OuterStride<>;
using StateMatrix = Eigen::Map<const Eigen::Matrix<double, kState, kState, Eigen::RowMajor>, 0, Strided>;
using BorderMatrix = Eigen::Map<const Eigen::Matrix<double, kState, Eigen::Dynamic, Eigen::RowMajor>, 0, Strided>;
using StateVector = Eigen::Matrix<double, kState, 1>;
using StateColumns = Eigen::Matrix<double, kState, 6>;

}  // namespace

ChainSystem::ChainSystem(std::size_t keyframes, int shared)
    : keyframes_(keyframes), shared_(shared), border_((1 + shared + 3) / 4 * 4), stride_(kResidual + border_) {
  clear();
}

void ChainSystem::clear() {
  normal_.assign(keyframes_ * kState * static_cast<std::size_t>(stride_), 0.0);
  corner_.assign(static_cast<std::size_t>(border_ * border_), 0.0);
}

void ChainSystem::add(const double* rows, int count, std::size_t k, bool second, int columns) {
  const int border = columns - kResidual;
  double* own = block(normal_, k);
  add_transposed_product(rows, stride_, kState, rows, stride_, second ? columns : kSecond, count, 1.0, own, stride_);
  if (second) {
    double* next = block(normal_, k + 1);
    add_transposed_product(rows + kSecond, stride_, kState, rows + kSecond, stride_, kState + 1, count, 1.0, next,
                           stride_);
    add_transposed_product(rows + kSecond, stride_, kState, rows + kResidual, stride_, border, count, 1.0,
                           next + kResidual, stride_);
  } else {
    add_transposed_product(rows, stride_, kState, rows + kResidual, stride_, border, count, 1.0, own + kResidual,
                           stride_);
  }
  add_transposed_product(rows + kResidual, stride_, border, rows + kResidual, stride_, border, count, 1.0,
                         corner_.data(), border_);
}

bool ChainSystem::factorize(double damping) {
  factor_ = normal_;
  std::vector<double> corner = corner_;
  for (std::size_t k = 0; k < keyframes_; ++k) {
    double* own = block(factor_, k);
    for (int i = 0; i < kState; ++i) own[i * stride_ + i] *= 1.0 + damping;
    if (k > 0) {
      const double* before = block(factor_, k - 1);
      add_transposed_product(before + kSecond, stride_, kState, before + kSecond, stride_, kState + 1, kState, -1.0,
                             own, stride_);
      add_transposed_product(before + kSecond, stride_, kState, before + kResidual, stride_, border_, kState, -1.0,
                             own + kResidual, stride_);
    }
    if (!eliminate_rows(own, stride_, kState, stride_)) return false;
    add_transposed_product(own + kResidual, stride_, border_, own + kResidual, stride_, border_, kState, -1.0,
                           corner.data(), border_);
  }
  const Eigen::Map<const Eigen::MatrixXd> rest(corner.data(), border_, border_);
  corner_root_ = rest.block(1, 1, shared_, shared_);
  for (int i = 0; i < shared_; ++i)
    corner_root_(i, i) += damping * corner_[static_cast<std::size_t>((i + 1) * (border_ + 1))];
  corner_gradient_ = rest.col(0).segment(1, shared_);
  Eigen::LLT<Eigen::MatrixXd> root(corner_root_);
  corner_root_ = root.matrixL();
  return root.info() == Eigen::Success;
}

void ChainSystem::step(std::vector<double>& result) const {
  result.resize(keyframes_ * kState + static_cast<std::size_t>(shared_));
  Eigen::Map<Eigen::VectorXd> shared(result.data() + keyframes_ * kState, shared_);
  shared = -corner_gradient_;
  corner_root_.triangularView<Eigen::Lower>().solveInPlace(shared);
  corner_root_.transpose().triangularView<Eigen::Upper>().solveInPlace(shared);
  for (std::size_t k = keyframes_; k-- > 0;) {
    const double* own = block(factor_, k);
    const BorderMatrix border(own + kResidual, kState, border_, Strided(stride_));
    StateVector right = -border.col(0) - border.middleCols(1, shared_) * shared;
    if (k + 1 < keyframes_) {
      right -= StateMatrix(own + kSecond, Strided(stride_)) *
               Eigen::Map<const StateVector>(result.data() + (k + 1) * kState);
    }
    StateMatrix(own, Strided(stride_)).triangularView<Eigen::Upper>().solveInPlace(right);
    Eigen::Map<StateVector>(result.data() + k * kState) = right;
  }
}

double ChainSystem::shared_variance(int index) const {
  Eigen::VectorXd column = Eigen::VectorXd::Unit(shared_, index);
  corner_root_.triangularView<Eigen::Lower>().solveInPlace(column);
  return column.squaredNorm();
}

Matrix6 ChainSystem::covariance(std::size_t keyframe) const {
  // H x = e by the factorization, forwards from the keyframe to the end and back again.
  std::vector<StateColumns> columns(keyframes_);
  Eigen::Matrix<double, Eigen::Dynamic, 6> shared = Eigen::Matrix<double, Eigen::Dynamic, 6>::Zero(shared_, 6);
  columns[keyframe].setZero();
  columns[keyframe].topRows<6>().setIdentity();
  for (std::size_t k = keyframe; k < keyframes_; ++k) {
    const double* own = block(factor_, k);
    if (k > keyframe) {
      columns[k].noalias() =
          -StateMatrix(block(factor_, k - 1) + kSecond, Strided(stride_)).transpose() * columns[k - 1];
    }
    StateMatrix(own, Strided(stride_)).transpose().triangularView<Eigen::Lower>().solveInPlace(columns[k]);
    shared.noalias() -=
        BorderMatrix(own + kResidual, kState, border_, Strided(stride_)).middleCols(1, shared_).transpose() *
        columns[k];
  }
  corner_root_.triangularView<Eigen::Lower>().solveInPlace(shared);
  corner_root_.transpose().triangularView<Eigen::Upper>().solveInPlace(shared);
  for (std::size_t k = keyframes_; k-- > keyframe;) {
    const double* own = block(factor_, k);
    columns[k].noalias() -=
        BorderMatrix(own + kResidual, kState, border_, Strided(stride_)).middleCols(1, shared_) * shared;
    if (k + 1 < keyframes_) columns[k].noalias() -= StateMatrix(own + kSecond, Strided(stride_)) * columns[k + 1];
    StateMatrix(own, Strided(stride_)).triangularView<Eigen::Upper>().solveInPlace(columns[k]);
  }
  const Matrix6 result = columns[keyframe].topRows<6>();
  return 0.5 * (result + result.transpose());
}

}  // namespace lodestone

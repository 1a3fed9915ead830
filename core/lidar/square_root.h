#pragma once

#include <Eigen/Cholesky>

namespace lodestone {

/// F with Fᵀ F = `moment`, symmetric. The matrix is often singular (a corridor, a plane, a scan without motion), or
/// nearly so by rounding. Pivoted LDLᵀ; negative pivots are set to zero.
template <int size>
Eigen::Matrix<double, size, size> square_root(const Eigen::Matrix<double, size, size>& moment) {
  using Matrix = Eigen::Matrix<double, size, size>;
  const Eigen::LDLT<Matrix> factor(moment);
  const Matrix upper = factor.matrixU();
  const Matrix permutation = factor.transpositionsP() * Matrix::Identity();
  return factor.vectorD().cwiseMax(0.0).cwiseSqrt().asDiagonal() * (upper * permutation);
}

}  // namespace lodestone

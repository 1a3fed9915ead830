#pragma once

#include <Eigen/Core>

namespace lodestone {

/// Cholesky factorization A = L Lᵀ of a dense matrix with hundreds of rows, by LAPACK: its kernels are those of the
/// machine, Eigen's those of the oldest supported processor. BLAS has one thread from the first factorization on.
class DenseCholesky {
 public:
  DenseCholesky() = default;

  /// O(N³). `matrix`: N×N; only the lower triangle is read. Throws InputError if this BLAS is not safe to call from
  /// several threads.
  explicit DenseCholesky(Eigen::MatrixXd matrix);

  /// Whether the matrix was positive definite. Nothing else may be called otherwise.
  bool is_positive_definite() const { return positive_definite_; }

  /// L⁻¹ b in place, N×M.
  void solve_lower(Eigen::MatrixXd& b) const;

  /// A⁻¹ b, N.
  Eigen::VectorXd solve(Eigen::VectorXd b) const;

  /// A⁻¹, both triangles.
  Eigen::MatrixXd inverse() const;

  /// ln |A|.
  double log_determinant() const { return 2.0 * factor_.diagonal().array().log().sum(); }

 private:
  Eigen::MatrixXd factor_;  ///< L in the lower triangle
  bool positive_definite_ = false;
};

}  // namespace lodestone

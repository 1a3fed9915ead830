#pragma once

#include <Eigen/SparseCore>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace lodestone {

/// Sparse matrices with compressed columns and the integer type of SuiteSparse.
using SparseMatrix = Eigen::SparseMatrix<double, Eigen::ColMajor, std::int64_t>;

/// A consecutive range of rows and columns: one variable.
struct IndexRange {
  Eigen::Index begin = 0;
  Eigen::Index size = 0;
};

/// The lower triangular factor L of an information matrix H = L Lᵀ, and covariances from it. L is sparse and stores all
/// entries of its pattern, zeros included: that of H's factor, and those with which CHOLMOD joins columns.
class SparseTriangle {
 public:
  /// L by CHOLMOD (supernodal, natural order). `information`: the lower triangle of H with its complete diagonal; row
  /// indices ascend. Empty if H is not positive definite in double precision.
  static std::optional<SparseTriangle> by_cholesky(const SparseMatrix& information);

  /// L = Rᵀ by SuiteSparseQR, with H = AᵀA and A = Q R. Keeps twice as many digits as Cholesky on H. `pattern`: that of
  /// H, as above; its values are ignored. A has at least as many rows as columns.
  static SparseTriangle by_qr(const SparseMatrix& rows, const SparseMatrix& pattern);

  /// The smallest share of a diagonal element of H that is left after elimination: min L_jj² / H_jj. The relative error
  /// of Cholesky's variances is about 1e-16 over this share.
  double least_pivot_share(const SparseMatrix& information) const;

  /// The covariance H⁻¹ of the given variables, in their order. One forward solve per column.
  Eigen::MatrixXd covariance(std::span<const IndexRange> variables) const;

  /// H⁻¹ times `right`.
  Eigen::MatrixXd solve(const Eigen::MatrixXd& right) const;

  /// The diagonal blocks of H⁻¹ for all variables, by the recursion of Takahashi, Fagan and Chin (1973); linear time in
  /// the size of H if L is banded. Each variable's own block of H must be dense.
  std::vector<Eigen::MatrixXd> diagonal_covariances(std::span<const IndexRange> variables) const;

 private:
  std::vector<double> inverse_on_pattern() const;

  /// The first of the columns before `end` that have the same rows below them.
  std::size_t group_begin(std::size_t end) const;

  /// L⁻¹ and L⁻ᵀ times a panel: one array for each row of a matrix with `width` columns. Without its first rows, those
  /// are zero (forward only).
  template <std::size_t width>
  void forward(std::span<std::array<double, width>> panel) const;
  template <std::size_t width>
  void backward(std::span<std::array<double, width>> panel) const;

  std::vector<std::int64_t> starts_;  // first entry of each column, then the number of entries
  std::vector<std::int64_t> rows_;    // ascending within a column, the diagonal first
  std::vector<double> values_;
};

}  // namespace lodestone

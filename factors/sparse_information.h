#pragma once

#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

#include "factors/sparse_triangle.h"
#include "factors/window_block.h"

namespace lodestone {

/// Joint information of factors about their variables: the Gauss-Newton matrix H = JᵀJ at the current values,
/// factorized by CHOLMOD in the given order of variables. Factors are linearized in parallel and summed in order, so
/// the result is bit-identical for any number of threads. Time and memory are linear in the length of a log if
/// variables are ordered by time and only the last variables are connected to all others.
///
/// Never fails. If Cholesky on H would lose the covariance's digits (a low-noise IMU beside weak priors), H's root is
/// computed by a QR factorization of J; every variable then has a prior with a sigma of 1e6 in its own unit (m, rad,
/// m/s, µT …), which bounds the variance of unobservable directions. If a Jacobian is not finite, every variance is
/// 1e12.
class SparseInformation {
 public:
  /// `variables`: in elimination order. Other blocks of the factors are constant.
  SparseInformation(std::vector<const WindowBlock*> variables, std::span<const WindowFactor* const> factors);

  /// Joint covariance of some of the variables: their tangents in the given order.
  Eigen::MatrixXd covariance(std::span<const WindowBlock* const> variables) const;

  /// H⁻¹ times `right`, whose rows are the tangents of all variables in order.
  Eigen::MatrixXd solve(const Eigen::MatrixXd& right) const;

  /// The rows of a variable among all tangents; empty for a constant.
  std::optional<IndexRange> range(const WindowBlock* variable) const {
    const auto found = numbers_.find(variable);
    if (found == numbers_.end()) return std::nullopt;
    return ranges_[static_cast<std::size_t>(found->second)];
  }

  Eigen::Index size() const { return information_.rows(); }

  /// Covariance of each variable alone, in the order of the variables.
  std::vector<Eigen::MatrixXd> covariances() const;

  /// Whether QR was used instead of Cholesky.
  bool by_qr() const { return by_qr_; }

 private:
  /// Numbers of a factor's variables, without constant blocks.
  struct Clique {
    const WindowFactor* factor;
    std::vector<int> variables;
  };
  void lay_out(std::span<const Clique> cliques);
  Eigen::Index offset_of(int row_variable, int column_variable) const;  // of a block below its diagonal block
  void add_factors(std::span<const Clique> cliques);
  void add_share(std::span<const int> variables, const Eigen::MatrixXd& share);
  SparseMatrix whitened_rows(std::span<const Clique> cliques) const;

  std::unordered_map<const WindowBlock*, int> numbers_;  // for look-up only: iteration order would depend on addresses
  std::vector<IndexRange> ranges_;
  std::vector<std::vector<int>> later_;  // larger variables that share a factor with each, ascending
  SparseMatrix information_;             // lower triangle
  std::optional<SparseTriangle> root_;   // empty: a Jacobian was not finite
  bool by_qr_ = false;
};

}  // namespace lodestone

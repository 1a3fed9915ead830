#pragma once

#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

#include "factors/sparse_triangle.h"
#include "factors/window_block.h"

namespace lodestone {

/// What factors know of their variables together: the Gauss-Newton information H = JᵀJ at the current values,
/// factorized by CHOLMOD in the order of the variables given. Factors are linearized in parallel and summed in their
/// order: the same bits on any number of threads. Time and memory are linear in the length of a log if the order is
/// that of time and the last variables alone touch all others.
///
/// Always gives an answer. If Cholesky on H would lose the covariance's digits (a low-noise IMU beside weak priors),
/// H's root comes from a QR factorization of J. Every variable then has a prior of one sigma 1e6 in its own unit (m,
/// rad, m/s, µT …), which bounds the variance of a direction that no factor sees. If a Jacobian is not finite, every
/// variance is 1e12.
class SparseInformation {
 public:
  /// `variables`: in the order of elimination. A block of a factor that is not among them is held constant.
  SparseInformation(std::vector<const WindowBlock*> variables, std::span<const WindowFactor* const> factors);

  /// Joint covariance of some of the variables: their tangents one after the other.
  Eigen::MatrixXd covariance(std::span<const WindowBlock* const> variables) const;

  /// H⁻¹ times `right`, whose rows are the variables' tangents in their order.
  Eigen::MatrixXd solve(const Eigen::MatrixXd& right) const;

  /// The rows of a variable among all tangents; nothing of a constant.
  std::optional<IndexRange> range(const WindowBlock* variable) const {
    const auto found = numbers_.find(variable);
    if (found == numbers_.end()) return std::nullopt;
    return ranges_[static_cast<std::size_t>(found->second)];
  }

  Eigen::Index size() const { return information_.rows(); }

  /// Covariance of each variable alone, in the order of the variables.
  std::vector<Eigen::MatrixXd> covariances() const;

  /// Whether QR took the place of Cholesky.
  bool by_qr() const { return by_qr_; }

 private:
  /// A factor's variables, by their number; those held constant are not among them.
  struct Clique {
    const WindowFactor* factor;
    std::vector<int> variables;
  };
  void lay_out(std::span<const Clique> cliques);
  Eigen::Index offset_of(int row_variable, int column_variable) const;  // of a block among its columns' rows
  void add_factors(std::span<const Clique> cliques);
  SparseMatrix whitened_rows(std::span<const Clique> cliques) const;

  std::unordered_map<const WindowBlock*, int> numbers_;  // looked up, never gone through: addresses decide nothing
  std::vector<IndexRange> ranges_;
  std::vector<std::vector<int>> earlier_;  // variables before each that share a factor with it, ascending
  SparseMatrix information_;               // upper triangle
  std::optional<SparseTriangle> root_;     // empty: a Jacobian was not finite
  bool by_qr_ = false;
};

}  // namespace lodestone

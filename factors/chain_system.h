#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "core/geometry/so3.h"

namespace lodestone {

/// Normal equations of a chain of keyframes, each coupled to its neighbours, and of a few variables shared by all:
/// block tridiagonal with a border. Factorizing is linear in the chain's length. The order of every sum is fixed.
class ChainSystem {
 public:
  static constexpr int kState = 15;  ///< variables of a keyframe: φ, p, v, b_g, b_a

  /// Where a factor's rows [keyframe k | keyframe k + 1 | residual, shared variables] have their columns.
  static constexpr int kSecond = 16;
  static constexpr int kResidual = 32;
  static constexpr int kShared = 33;

  ChainSystem(std::size_t keyframes, int shared);

  /// Doubles of one row.
  int stride() const { return stride_; }

  void clear();

  /// Adds `rows` whitened rows of a factor whose first keyframe is `k`. `second`: it touches keyframe k + 1 too.
  /// `columns`: a multiple of 4, beyond which the rows hold zeros. A factor on shared variables alone may name any
  /// keyframe.
  void add(const double* rows, int count, std::size_t k, bool second, int columns);

  /// Factorizes with the diagonal raised by the share `damping`; false where it is not positive.
  bool factorize(double damping);

  /// The Gauss-Newton step of the last factorization: 15 numbers a keyframe, then the shared ones.
  void step(std::vector<double>& result) const;

  /// Covariance of a keyframe's first six variables, of the last factorization.
  Matrix6 covariance(std::size_t keyframe) const;

  /// Variance of a shared variable, of the last factorization.
  double shared_variance(int index) const;

 private:
  double* block(std::vector<double>& of, std::size_t k) const {
    return of.data() + k * kState * static_cast<std::size_t>(stride_);
  }
  const double* block(const std::vector<double>& of, std::size_t k) const {
    return of.data() + k * kState * static_cast<std::size_t>(stride_);
  }

  std::size_t keyframes_;
  int shared_;
  int border_;  // the residual's column, the shared ones', and up to a multiple of 4
  int stride_;
  std::vector<double> normal_;   // a keyframe: 15 rows of [own | next | gradient, shared]
  std::vector<double> corner_;   // border × border
  std::vector<double> factor_;   // R and R⁻ᵀ of the rest, in the same places
  Eigen::MatrixXd corner_root_;  // lower
  Eigen::VectorXd corner_gradient_;
};

}  // namespace lodestone

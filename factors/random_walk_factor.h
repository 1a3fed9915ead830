#pragma once

#include <ceres/cost_function.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

namespace lodestone {

/// A random walk: r = (second − first) / σ. Parameters: two blocks of the same size; or only the second, with zero as
/// the first. Jumps are allowed: every `group` components share the weight of a Student distribution with four degrees
/// of freedom and scale σ. The weight is constant during a solve (renew) and at most one, so that a jump that
/// measurements require costs little (docs/design/016-magnetometer-biases.md).
class RandomWalkFactor final : public ceres::CostFunction {
 public:
  RandomWalkFactor(int size, double sigma, bool from_zero = false, int group = 3)
      : size_(size), group_(group), sigma_(sigma), whitening_(static_cast<std::size_t>(size), 1.0 / sigma) {
    set_num_residuals(size);
    mutable_parameter_block_sizes()->assign(from_zero ? 1 : 2, size);
  }

  /// A prior about zero with a separate sigma for each component.
  static std::unique_ptr<RandomWalkFactor> prior(const std::vector<double>& sigmas) {
    auto result = std::make_unique<RandomWalkFactor>(static_cast<int>(sigmas.size()), 1.0, true);
    for (std::size_t i = 0; i < sigmas.size(); ++i) result->whitening_[i] = 1.0 / sigmas[i];
    return result;
  }

  /// Computes new weights from the step between `first` (null: zero) and `second`.
  void renew(const double* first, const double* second) {
    constexpr double kFreedom = 4.0;
    for (int begin = 0; begin < size_; begin += group_) {
      const int end = std::min(size_, begin + group_);
      double squared = 0.0;
      for (int i = begin; i < end; ++i) {
        const double step = (second[i] - (first == nullptr ? 0.0 : first[i])) / sigma_;
        squared += step * step;
      }
      const double weight = std::min(1.0, (kFreedom + group_) / (kFreedom + squared));
      std::fill(whitening_.begin() + begin, whitening_.begin() + end, std::sqrt(weight) / sigma_);
    }
  }

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const int blocks = static_cast<int>(parameter_block_sizes().size());
    for (int i = 0; i < size_; ++i) {
      const double first = blocks == 1 ? 0.0 : parameters[0][i];
      residuals[i] = whitening_[static_cast<std::size_t>(i)] * (parameters[blocks - 1][i] - first);
    }
    for (int block = 0; block < blocks; ++block) {
      if (jacobians == nullptr || jacobians[block] == nullptr) continue;
      std::fill_n(jacobians[block], size_ * size_, 0.0);
      for (int i = 0; i < size_; ++i) {
        const double slope = whitening_[static_cast<std::size_t>(i)];
        jacobians[block][i * (size_ + 1)] = block + 1 < blocks ? -slope : slope;
      }
    }
    return true;
  }

 private:
  int size_;
  int group_;
  double sigma_;
  std::vector<double> whitening_;
};

}  // namespace lodestone

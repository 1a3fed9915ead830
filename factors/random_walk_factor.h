#pragma once

#include <ceres/cost_function.h>

namespace lodestone {

/// A vector that drifts: r = (second − first) / σ. Parameters: two blocks of the same size.
class RandomWalkFactor final : public ceres::CostFunction {
 public:
  RandomWalkFactor(int size, double sigma) : size_(size), whitening_(1.0 / sigma) {
    set_num_residuals(size);
    mutable_parameter_block_sizes()->assign(2, size);
  }

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    for (int i = 0; i < size_; ++i) residuals[i] = whitening_ * (parameters[1][i] - parameters[0][i]);
    for (int block = 0; block < 2; ++block) {
      if (jacobians == nullptr || jacobians[block] == nullptr) continue;
      for (int i = 0; i < size_ * size_; ++i) jacobians[block][i] = 0.0;
      for (int i = 0; i < size_; ++i) jacobians[block][i * (size_ + 1)] = block == 0 ? -whitening_ : whitening_;
    }
    return true;
  }

 private:
  int size_;
  double whitening_;
};

}  // namespace lodestone

#pragma once

#include <array>

#include "core/mapping/gaussian_process.h"
#include "core/mapping/windowed_regression.h"

namespace lodestone {

/// One kernel per component, in µT.
using FieldKernels = std::array<KernelParameters, 3>;

/// Sliding-window Gaussian-process regression (s-GPR, Lyu et al. 2024): exact regression of each component separately.
class SlidingGpr : public WindowedRegression {
 public:
  /// Throws std::invalid_argument without cells.
  SlidingGpr(std::vector<FieldCell> cells, const FieldKernels& kernels, const SlidingGprOptions& options);

  WindowPrediction solve_window(std::int64_t row, std::int64_t column,
                                const std::vector<Vector3>& points) const override;

 private:
  FieldKernels kernels_;
};

}  // namespace lodestone

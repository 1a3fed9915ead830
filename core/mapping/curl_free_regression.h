#pragma once

#include "core/mapping/curl_free_kernel.h"
#include "core/mapping/windowed_regression.h"

namespace lodestone {

/// Curl-free regression: one potential explains the three components (CurlFreeKernel). In each window, φ is a sum of
/// eigenfunctions of the Laplace operator on a box around the training cells. The prior variance of their weights is
/// the kernel's spectral density (Solin et al. 2018, section IV). The cost is linear in the cells and cubic in the
/// functions. The box has margins on all three axes. Within a window, the mean field has no curl. Blending adds a curl
/// only where windows disagree.
class CurlFreeRegression : public WindowedRegression {
 public:
  /// Throws std::invalid_argument without cells.
  CurlFreeRegression(std::vector<FieldCell> cells, const CurlFreeKernel& kernel, const SlidingGprOptions& options);

  /// Points above or below all cells of the window by more than the reach, in vertical length scales, get the prior.
  /// Throws InputError if the height span of the window's cells requires more functions than `most_functions`.
  WindowPrediction solve_window(std::int64_t row, std::int64_t column,
                                const std::vector<Vector3>& points) const override;

  static constexpr std::size_t most_functions = 4000;  ///< 130 MB per thread

 private:
  CurlFreeKernel kernel_;
};

}  // namespace lodestone

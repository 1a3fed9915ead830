#pragma once

#include "core/mapping/curl_free_kernel.h"
#include "core/mapping/windowed_regression.h"

namespace lodestone {

/// Curl-free regression: one potential explains the three components (CurlFreeKernel). In each window φ is a sum of
/// eigenfunctions of the Laplace operator on a box round the training cells, with weights whose prior variance is the
/// kernel's spectral density (Solin et al. 2018, section IV): linear in the cells, cubic in the functions. The box is
/// three-dimensional: it reaches beyond the cells' heights as it does beyond their places. Within a window the mean
/// field has no curl; where windows blend it has as little as they disagree.
class CurlFreeRegression : public WindowedRegression {
 public:
  /// Throws std::invalid_argument without cells.
  CurlFreeRegression(std::vector<FieldCell> cells, const CurlFreeKernel& kernel, const SlidingGprOptions& options);

  /// Points higher or lower than all cells of the window by more than the reach, in vertical length scales, have the
  /// prior. Throws InputError where the cells of the window span so much height that the box needs more functions than
  /// `most_functions`.
  WindowPrediction solve_window(std::int64_t row, std::int64_t column,
                                const std::vector<Vector3>& points) const override;

  static constexpr std::size_t most_functions = 4000;  ///< 130 MB a thread

 private:
  CurlFreeKernel kernel_;
};

}  // namespace lodestone

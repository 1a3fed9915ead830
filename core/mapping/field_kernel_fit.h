#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "core/mapping/curl_free_kernel.h"
#include "core/mapping/sliding_gpr.h"
#include "core/options.h"

namespace lodestone {

/// How a map is regressed from its survey.
enum class FieldMethod {
  sliding_gpr,  ///< each component by itself (s-GPR)
  curl_free     ///< the gradient of one potential
};

constexpr auto enum_names(FieldMethod) {
  return EnumNames<FieldMethod, 2>{{{FieldMethod::sliding_gpr, "s-gpr"}, {FieldMethod::curl_free, "curl-free"}}};
}

/// What the survey says of the field's kernels.
struct FieldKernelFit {
  FieldKernels kernels;                     ///< a component; with `potential`, what it makes of each
  std::optional<CurlFreeKernel> potential;  ///< of the curl-free method
  double cell_m = 0.0;                      ///< voxel side that the noise sigma of the kernels refers to
  int windows = 0;
  int evaluations = 0;
  Vector3 uncalibrated_noise = Vector3::Zero();  ///< noise_sigma of the likelihood alone, µT
};

/// Fits hyperparameters by marginal likelihood on a deterministic choice of windows: one set a component, or one for
/// the potential. The survey is thinned to voxels of `finest_cell_m`, or coarser where the length scale allows
/// (options.cells_per_length_scale).
/// The likelihood takes errors of the survey that are alike along a stretch (a turn's calibration error, a stamp that
/// is late, a drift) for structure of the field; only another pass tells them apart. So the noise is then calibrated:
/// some blocks of time are predicted from the rest, and where they miss by more than predicted the noise is raised.
/// Surveys without stamps, or without a second pass, keep the likelihood's noise. Throws InputError where there are
/// fewer than 10 cells.
FieldKernelFit fit_field_kernels(const std::vector<FieldObservation>& observations, double finest_cell_m,
                                 const SlidingGprOptions& options, FieldMethod method = FieldMethod::sliding_gpr);

/// The regression that a fit is for. Throws std::invalid_argument without cells.
std::unique_ptr<const WindowedRegression> make_regression(std::vector<FieldCell> cells, const FieldKernelFit& fit,
                                                          const SlidingGprOptions& options);

}  // namespace lodestone

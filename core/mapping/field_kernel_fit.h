#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "core/mapping/curl_free_kernel.h"
#include "core/mapping/drive_error.h"
#include "core/mapping/sliding_gpr.h"
#include "core/options.h"

namespace lodestone {

/// How a map is estimated from its survey.
enum class FieldMethod {
  sliding_gpr,  ///< each component separately (s-GPR)
  curl_free     ///< the gradient of one potential
};

constexpr auto enum_names(FieldMethod) {
  return EnumNames<FieldMethod, 2>{{{FieldMethod::sliding_gpr, "s-gpr"}, {FieldMethod::curl_free, "curl-free"}}};
}

/// The fitted kernels of a survey.
struct FieldKernelFit {
  FieldKernels kernels;                     ///< one per component; with `potential`, the kernels that follow from it
  std::optional<CurlFreeKernel> potential;  ///< of the curl-free method
  double cell_m = 0.0;                      ///< voxel side for which the kernels' noise sigma is valid
  int windows = 0;
  int evaluations = 0;
  Vector3 uncalibrated_noise = Vector3::Zero();  ///< noise_sigma before the calibration, µT
  DriveError drive;                              ///< zero without a second pass, or if the predicted variances suffice
};

/// Fits hyperparameters by marginal likelihood on a deterministic choice of windows: one set per component, or one for
/// the potential. The survey is thinned to voxels of `finest_cell_m`, or coarser if the length scale allows
/// (options.cells_per_length_scale).
/// The likelihood alone cannot distinguish correlated survey errors (calibration error, late stamps, drift) from the
/// field; a second pass can. Therefore held-out blocks of way are predicted from the rest, and the noise is raised
/// until the predicted variances match the errors. Surveys without stamps or without a second pass keep the
/// likelihood's noise. Throws InputError if there are fewer than 10 cells.
FieldKernelFit fit_field_kernels(const std::vector<FieldObservation>& observations, double finest_cell_m,
                                 const SlidingGprOptions& options, FieldMethod method = FieldMethod::sliding_gpr);

/// The regression with the kernels of `fit`. Throws std::invalid_argument without cells.
std::unique_ptr<const WindowedRegression> make_regression(std::vector<FieldCell> cells, const FieldKernelFit& fit,
                                                          const SlidingGprOptions& options);

}  // namespace lodestone

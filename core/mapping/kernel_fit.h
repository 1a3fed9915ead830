#pragma once

#include <vector>

#include "core/mapping/gaussian_process.h"

namespace lodestone {

/// Limits of the search. If a parameter ends at a limit, the data do not determine it.
struct KernelBounds {
  double min_length_scale_m = 0.05;
  double max_length_scale_m = 20.0;
  double min_sigma = 1e-3;  ///< of signal and noise
  double max_sigma = 1e3;
};

struct KernelFit {
  KernelParameters parameters;
  double log_likelihood = 0.0;  ///< summed over the data sets
  int evaluations = 0;
  bool converged = false;
};

/// Maximum-likelihood signal sigma, length scale and noise sigma over all `sets`. The sets are independent draws with
/// one kernel. `start` gives mean and mean_sigma, which are fixed, and the initial values of the other parameters.
/// Other length scales are tried too, because the likelihood can have several maxima. Quasi-Newton (BFGS) in the
/// logarithms, with bounds. Deterministic on any number of threads. Throws std::invalid_argument without sets.
KernelFit fit_kernel(const std::vector<GaussianProcessData>& sets, const KernelParameters& start,
                     const KernelBounds& bounds);

}  // namespace lodestone

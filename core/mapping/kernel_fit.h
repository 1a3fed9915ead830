#pragma once

#include <vector>

#include "core/mapping/gaussian_process.h"

namespace lodestone {

/// Limits of the search. A parameter that ends at a limit says that the data do not determine it.
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

/// The signal sigma, length scale and noise sigma under which all `sets` together are most likely; the sets count as
/// independent draws with one kernel. `start` gives mean and mean_sigma, which stay, and a first guess of the rest;
/// other length scales are tried beside it, since the likelihood can have several maxima.
/// Quasi-Newton (BFGS) in the logarithms, with bounds. Deterministic on any number of threads.
/// Throws std::invalid_argument where there is no set.
KernelFit fit_kernel(const std::vector<GaussianProcessData>& sets, const KernelParameters& start,
                     const KernelBounds& bounds);

}  // namespace lodestone

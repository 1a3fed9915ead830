#pragma once

#include <span>
#include <vector>

#include "estimators/baselines/state_cloud.h"

namespace lodestone {

/// Low-variance resampling (Thrun, Burgard and Fox 2005, table 4.4): indices of `count` draws from `weights` (of sum
/// 1), in ascending order. `offset`: in [0, 1). An index with weight w is drawn ⌊count w⌋ or ⌈count w⌉ times.
std::vector<std::size_t> low_variance_draws(std::span<const double> weights, std::size_t count, double offset);

/// 1 / Σ w², for weights of sum 1.
double effective_number(std::span<const double> weights);

/// KLD-sampling (Fox 2003, eq. 7): the number of particles with which the Kullback-Leibler distance of a distribution
/// over `bins` occupied bins is below `error`, with `probability`. 1 for a single bin.
double kld_number(std::size_t bins, double error, double probability);

/// Particles divided into bins of x, y and heading, and bins that touch each other into modes.
struct ParticleModes {
  std::vector<int> mode;  ///< of each particle
  int modes = 0;
  std::size_t bins = 0;  ///< occupied ones
};

ParticleModes find_modes(std::span<const WeightedState> particles, double bin_m, double bin_rad);

}  // namespace lodestone

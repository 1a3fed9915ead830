#pragma once

namespace lodestone {

/// Huber's weight on a distance s ≥ 0 with threshold c > 0: 1 up to c, then c / s.
inline double huber_weight(double distance, double threshold) {
  return distance <= threshold ? 1.0 : threshold / distance;
}

/// √ of the χ² quantile: the Mahalanobis distance that a residual of `degrees_of_freedom` stays below with
/// `probability`. The paper's c = 3.55 is the value for six degrees and 0.95. Throws std::invalid_argument if
/// degrees_of_freedom < 1 or probability is not in (0, 1).
double mahalanobis_quantile(int degrees_of_freedom, double probability);

}  // namespace lodestone

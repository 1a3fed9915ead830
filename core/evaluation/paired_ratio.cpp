#include "core/evaluation/paired_ratio.h"

#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <stdexcept>

namespace lodestone {

double student_t_quantile(std::size_t degrees_of_freedom, double probability) {
  if (degrees_of_freedom < 1 || !(probability > 0.0 && probability < 1.0)) {
    throw std::invalid_argument("student_t_quantile: degrees of freedom or probability out of range");
  }
  return boost::math::quantile(boost::math::students_t(static_cast<double>(degrees_of_freedom)), probability);
}

RatioEstimate estimate_ratio(const std::vector<double>& ratios, double confidence) {
  if (ratios.empty()) throw std::invalid_argument("estimate_ratio: no ratios");
  const double count = static_cast<double>(ratios.size());
  double mean = 0.0;
  for (const double ratio : ratios) {
    if (!(ratio > 0.0 && std::isfinite(ratio)))
      throw std::invalid_argument("estimate_ratio: a ratio is not positive and finite");
    mean += std::log(ratio) / count;
  }
  RatioEstimate estimate{ratios.size(), std::exp(mean), {}, {}};
  if (ratios.size() < 2) return estimate;
  double squares = 0.0;
  for (const double ratio : ratios) squares += (std::log(ratio) - mean) * (std::log(ratio) - mean);
  const double half =
      student_t_quantile(ratios.size() - 1, 0.5 + 0.5 * confidence) * std::sqrt(squares / (count - 1.0) / count);
  estimate.low = std::exp(mean - half);
  estimate.high = std::exp(mean + half);
  return estimate;
}

}  // namespace lodestone

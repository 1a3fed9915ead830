#include "core/robust_weight.h"

#include <boost/math/distributions/chi_squared.hpp>
#include <cmath>
#include <stdexcept>

namespace lodestone {

double mahalanobis_quantile(int degrees_of_freedom, double probability) {
  if (degrees_of_freedom < 1 || !(probability > 0.0 && probability < 1.0)) {
    throw std::invalid_argument("mahalanobis_quantile: degrees of freedom or probability out of range");
  }
  return std::sqrt(boost::math::quantile(boost::math::chi_squared(degrees_of_freedom), probability));
}

}  // namespace lodestone

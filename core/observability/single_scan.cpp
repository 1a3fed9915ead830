#include "core/observability/single_scan.h"

#include <algorithm>

namespace lodestone {

namespace {

constexpr double kUnobserved_m = 0.1;  // far from both: in halls up to 0.02 m, in tunnels infinite (050)

}  // namespace

Degeneracy analyse_scan(const CondensedCost& cost, const Pose& T_map_imu, const DegeneracyOptions& options) {
  return analyse_by_sigma(cost.hessian(T_map_imu) - kNormalNoiseMargin * cost.spurious_information,
                          std::max(cost.range_rms_m, 1.0), options);
}

int unobserved_directions(const Degeneracy& by_scan) {
  return static_cast<int>((by_scan.sigma_m.array() > kUnobserved_m).count());
}

}  // namespace lodestone

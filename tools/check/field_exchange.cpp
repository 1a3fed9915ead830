#include "tools/check/field_exchange.h"

#include <algorithm>
#include <limits>
#include <numeric>

#include "tools/check/vector_series.h"

namespace lodestone {
namespace {

constexpr double exchanged_ut = 0.8;  // smaller differences do no harm
constexpr double exchange_explains = 0.7;
constexpr double shape_explains =
    0.85;  // after subtracting the offset, so that hard iron alone cannot look like an exchange
constexpr double least_common = 0.5;  // share of readings at common times

/// Difference of readings from a mount's field, µT. Medians are robust to passing steel.
struct Misfit {
  double all_ut = std::numeric_limits<double>::infinity();
  double shape_ut = std::numeric_limits<double>::infinity();  ///< after subtracting the median difference

  bool explains(const Misfit& other) const {
    return all_ut < exchange_explains * other.all_ut && shape_ut < shape_explains * other.shape_ut;
  }
};

Misfit misfit_of(const FieldSeries& mount, const FieldSeries& readings) {
  const FieldSeries pair = exchanged(mount, readings);
  const double common = least_common * static_cast<double>(std::max<std::size_t>(1, readings.times.size()));
  if (static_cast<double>(pair.times.size()) < common) return {};
  std::vector<Vector3> differences = pair.differences();
  const double all_ut = median_length(differences);
  const Vector3 offset = component_medians(differences);
  for (Vector3& difference : differences) difference -= offset;
  return {all_ut, median_length(differences)};
}

}  // namespace

FieldSeries exchanged(const FieldSeries& mount, const FieldSeries& readings) {
  FieldSeries result;
  result.way_m = mount.way_m;
  std::size_t k = 0;
  for (std::size_t i = 0; i < mount.times.size(); ++i) {
    while (k < readings.times.size() && readings.times[k] < mount.times[i]) ++k;
    if (k == readings.times.size()) break;
    if (readings.times[k] != mount.times[i]) continue;
    result.times.push_back(mount.times[i]);
    result.measured_ut.push_back(readings.measured_ut[k]);
    result.expected_ut.push_back(mount.expected_ut[i]);
    result.variance_ut2.push_back(mount.variance_ut2[i]);
    result.noise_ut2.push_back(readings.noise_ut2[k]);
  }
  return result;
}

std::vector<std::size_t> match_mounts(const std::vector<FieldSeries>& all) {
  std::vector<std::size_t> followed(all.size());
  std::iota(followed.begin(), followed.end(), std::size_t{0});
  std::vector<std::size_t> odd;
  std::vector<Misfit> own(all.size());
  for (std::size_t j = 0; j < all.size(); ++j) {
    if (all[j].times.empty()) continue;
    own[j] = misfit_of(all[j], all[j]);
    if (own[j].all_ut > exchanged_ut) odd.push_back(j);
  }
  std::vector<std::size_t> best = followed;
  for (const std::size_t j : odd) {
    Misfit least = own[j];
    for (const std::size_t k : odd) {
      if (k == j) continue;
      const Misfit there = misfit_of(all[k], all[j]);
      if (!there.explains(own[j]) || there.all_ut >= least.all_ut) continue;
      least = there;
      best[j] = k;
    }
  }
  // Keep closed rings only: each magnetometer must take the mount of another exchanged one.
  for (const std::size_t j : odd) {
    std::size_t k = best[j];
    std::size_t steps = 1;
    for (; k != j && steps <= odd.size() && best[k] != k; ++steps) k = best[k];
    if (k == j) followed[j] = best[j];
  }
  return followed;
}

}  // namespace lodestone

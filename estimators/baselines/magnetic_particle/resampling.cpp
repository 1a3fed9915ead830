#include "estimators/baselines/magnetic_particle/resampling.h"

#include <algorithm>
#include <array>
#include <boost/math/distributions/normal.hpp>
#include <cmath>
#include <map>

namespace lodestone {

namespace {

using Bin = std::array<int, 3>;  // x, y, heading

/// ⌊value⌋; 0 if it is not a number of a usual size, as in a state that has diverged.
int bin_number(double value) {
  constexpr double most = 1e9;
  return std::abs(value) < most ? static_cast<int>(std::floor(value)) : 0;
}

int root_of(std::vector<int>& parents, int i) {
  while (parents[i] != i) i = parents[i] = parents[parents[i]];
  return i;
}

}  // namespace

std::vector<std::size_t> low_variance_draws(std::span<const double> weights, std::size_t count, double offset) {
  std::vector<std::size_t> result;
  result.reserve(count);
  const double step = 1.0 / static_cast<double>(count);
  double sum = weights[0];
  std::size_t i = 0;
  for (std::size_t m = 0; m < count; ++m) {
    const double target = (static_cast<double>(m) + offset) * step;
    while (target >= sum && i + 1 < weights.size()) sum += weights[++i];
    result.push_back(i);
  }
  return result;
}

double effective_number(std::span<const double> weights) {
  double squares = 0.0;
  for (const double weight : weights) squares += weight * weight;
  return 1.0 / squares;
}

double kld_number(std::size_t bins, double error, double probability) {
  if (bins < 2) return 1.0;
  const double quantile = boost::math::quantile(boost::math::normal(), probability);
  const double degrees = static_cast<double>(bins) - 1.0;
  const double share = 2.0 / (9.0 * degrees);  // Wilson and Hilferty's approximation of the χ² quantile
  return degrees / (2.0 * error) * std::pow(1.0 - share + std::sqrt(share) * quantile, 3);
}

ParticleModes find_modes(std::span<const WeightedState> particles, double bin_m, double bin_rad) {
  const int headings = std::max(1, static_cast<int>(std::lround(2.0 * M_PI / bin_rad)));
  std::map<Bin, int> bins;  // to an index
  std::vector<int> bin_of;
  for (const WeightedState& particle : particles) {
    const Pose& pose = particle.state.T_map_imu;
    const double turns = heading_rad(pose.rotation) / (2.0 * M_PI);
    const int heading = bin_number((turns - std::floor(turns)) * headings) % headings;
    const Bin bin{bin_number(pose.position.x() / bin_m), bin_number(pose.position.y() / bin_m), heading};
    bin_of.push_back(bins.emplace(bin, static_cast<int>(bins.size())).first->second);
  }
  std::vector<int> parents(bins.size());
  for (std::size_t i = 0; i < parents.size(); ++i) parents[i] = static_cast<int>(i);
  for (const auto& [bin, index] : bins) {
    for (int neighbour = 0; neighbour < 27; ++neighbour) {
      const Bin other{bin[0] + neighbour % 3 - 1, bin[1] + neighbour / 3 % 3 - 1,
                      (bin[2] + neighbour / 9 - 1 + headings) % headings};
      const auto found = bins.find(other);
      if (found != bins.end()) parents[root_of(parents, found->second)] = root_of(parents, index);
    }
  }
  ParticleModes result;
  result.bins = bins.size();
  std::vector<int> numbers(bins.size(), -1);  // of modes, in the order of their first particles
  for (const int bin : bin_of) {
    int& number = numbers[root_of(parents, bin)];
    if (number < 0) number = result.modes++;
    result.mode.push_back(number);
  }
  return result;
}

}  // namespace lodestone

#include "estimators/mixture/place_past.h"

#include <Eigen/Cholesky>
#include <cmath>

#include "core/parallel.h"

namespace lodestone {

namespace {

/// Places with less of the weight are not smoothed: a metre apart, they add a centimetre to the sigma.
constexpr double kLeastShare = 1e-4;

}  // namespace

PlaceComponent smoothed_before(const PlaceComponent& before, const Preintegration& increment,
                               const PlaceComponent& after, const ImuNoise& noise) {
  PlaceComponent predicted = before;
  Eigen::MatrixXd crossed;
  predict_place(increment, noise, predicted, crossed);
  // The gain P Fᵀ (F P Fᵀ + Q)⁻¹.
  const Eigen::LDLT<Eigen::MatrixXd> factor(predicted.covariance);
  const Eigen::MatrixXd gain = factor.solve(crossed).transpose();
  PlaceComponent result = before;
  result.move(gain * step_between(predicted, after));
  const Eigen::MatrixXd change = after.covariance - predicted.covariance;
  result.covariance += gain * change * gain.transpose();
  result.covariance = (0.5 * (result.covariance + result.covariance.transpose())).eval();
  result.log_weight = after.log_weight;
  return result;
}

void PlacePast::add(std::optional<Preintegration> increment, std::vector<PlaceComponent> places) {
  scans_.push_back({std::move(increment), std::move(places)});
  forget_childless();
}

/// Most components have no child some scans later. Their covariances are most of the memory.
void PlacePast::forget_childless() {
  for (std::size_t k = scans_.size() - 1; k > 0; --k) {
    std::vector<PlaceComponent>& places = scans_[k - 1].places;
    std::vector<bool> has_child(places.size(), false);
    for (const PlaceComponent& one : scans_[k].places) {
      if (one.covariance.size() > 0) has_child[one.parent] = true;
    }
    bool changed = false;
    for (std::size_t i = 0; i < places.size(); ++i) {
      if (has_child[i] || places[i].covariance.size() == 0) continue;
      places[i].covariance.resize(0, 0);
      changed = true;
    }
    if (!changed) return;
  }
}

std::vector<std::vector<PlaceComponent>> PlacePast::take(std::size_t count, std::size_t last) {
  std::vector<double> shares;
  for (const PlaceComponent& one : scans_.back().places) shares.push_back(std::exp(one.log_weight));
  std::vector<std::vector<PlaceComponent>> result(count);
  std::vector<PlaceComponent> smoothed;
  for (std::size_t k = scans_.size(); k-- > 0;) {
    const std::vector<PlaceComponent>& places = scans_[k].places;
    if (k == last) {
      for (std::size_t i = 0; i < places.size(); ++i) {
        if (!(shares[i] > kLeastShare)) continue;
        smoothed.push_back(places[i]);
        smoothed.back().log_weight = std::log(shares[i]);
      }
    }
    if (k < count) result[k] = smoothed;
    if (k == 0) break;
    const std::vector<PlaceComponent>& before = scans_[k - 1].places;
    std::vector<double> shares_before(before.size(), 0.0);
    for (std::size_t i = 0; i < shares.size(); ++i) shares_before[places[i].parent] += shares[i];
    shares = std::move(shares_before);
    if (k > last) continue;
    const std::optional<Preintegration>& increment = scans_[k].increment;
    std::vector<PlaceComponent> given_children(smoothed.size());
    parallel_for(
        std::size_t{0}, smoothed.size(),
        [&](std::size_t i) {
          const PlaceComponent& parent = before[smoothed[i].parent];
          given_children[i] = increment ? smoothed_before(parent, *increment, smoothed[i], noise_) : smoothed[i];
          given_children[i].parent = parent.parent;
        },
        4);
    std::vector<std::vector<const PlaceComponent*>> by_parent(before.size());
    for (std::size_t i = 0; i < smoothed.size(); ++i) by_parent[smoothed[i].parent].push_back(&given_children[i]);
    std::vector<PlaceComponent> merged;
    for (const auto& children : by_parent) {
      if (!children.empty()) merged.push_back(merged_place(children));
    }
    smoothed = std::move(merged);
  }
  scans_.erase(scans_.begin(), scans_.begin() + static_cast<std::ptrdiff_t>(count));
  return result;
}

}  // namespace lodestone

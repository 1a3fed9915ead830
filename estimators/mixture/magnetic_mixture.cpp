#include "estimators/mixture/magnetic_mixture.h"

#include <algorithm>
#include <cmath>

#include "core/stopwatch.h"

namespace lodestone {

namespace {

constexpr Time kLag = from_seconds(20.0);
/// Places nearer than this to the heaviest one are one place.
constexpr double kOnePlace_m = 0.3;

}  // namespace

MagneticMixture::MagneticMixture(EstimatorInput input)
    : input_(std::move(input)), matching_(input_), mixture_(input_) {}

void MagneticMixture::process(const ScanBundle& bundle, EstimateSink& sink) {
  const Stopwatch step;
  mixture_.process(bundle);
  Moment moment;
  weights_.clear();
  for (const PlaceComponent& one : mixture_.components()) {
    moment.places.push_back({one.state, one.covariance.topLeftCorner<6, 6>(), one.parent});
    weights_.push_back(std::exp(one.log_weight));
  }
  moment.causal.time = bundle.scan.end;
  set_estimate(moment.places, weights_, moment.causal);
  const NavState& state = moment.causal.state;
  matching_.report(matching_.match(bundle, state), state.T_map_imu, moment.causal.diagnostics);
  moment.causal.diagnostics.step_ms = step.elapsed_ms();
  sink.causal(moment.causal);
  moments_.push_back(std::move(moment));
  while (moments_.back().causal.time - moments_.front().causal.time > kLag) report(sink);
}

void MagneticMixture::finish(EstimateSink& sink) {
  while (!moments_.empty()) report(sink);
}

void MagneticMixture::set_estimate(const std::vector<Place>& places, const std::vector<double>& weights,
                                   Estimate& estimate) {
  const auto heaviest = std::max_element(weights.begin(), weights.end()) - weights.begin();
  const NavState& reference = places[static_cast<std::size_t>(heaviest)].state;
  Vector17 mean = Vector17::Zero();
  double sum = 0.0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const Vector17 step = places[i].state.boxminus(reference);
    if (weights[i] == 0.0 || !(step.segment<3>(tangent::position).norm() < kOnePlace_m)) continue;
    mean += weights[i] * step;
    sum += weights[i];
  }
  estimate.state = reference.boxplus(mean / sum);
  estimate.covariance.setZero();
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (weights[i] == 0.0) continue;
    const Vector6 apart = places[i].state.T_map_imu.boxminus(estimate.state.T_map_imu);
    estimate.covariance += weights[i] * (places[i].covariance + apart * apart.transpose());
  }
}

void MagneticMixture::report(EstimateSink& sink) {
  std::vector<double> weights = weights_;
  for (std::size_t k = moments_.size() - 1; k > 0; --k) {
    std::vector<double> before(moments_[k - 1].places.size(), 0.0);
    for (std::size_t i = 0; i < weights.size(); ++i) before[moments_[k].places[i].parent] += weights[i];
    weights = std::move(before);
  }
  Moment& oldest = moments_.front();
  Estimate best = oldest.causal;
  set_estimate(oldest.places, weights, best);
  sink.best(best);
  moments_.pop_front();
}

}  // namespace lodestone

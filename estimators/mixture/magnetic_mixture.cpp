#include "estimators/mixture/magnetic_mixture.h"

#include <algorithm>
#include <cmath>

#include "core/stopwatch.h"

namespace lodestone {

namespace {

constexpr double kLag_s = 20.0;   ///< of later readings that choose a place
constexpr double kBlock_s = 5.0;  ///< scans are smoothed together
/// The newest scans choose, but do not smooth: their components are many.
constexpr double kUnsmoothed_s = 5.0;
/// Places nearer than this to the heaviest one are one place.
constexpr double kOnePlace_m = 0.3;

}  // namespace

MagneticMixture::MagneticMixture(EstimatorInput input)
    : input_(std::move(input)), matching_(input_), mixture_(input_), past_(input_.suite.imu) {}

void MagneticMixture::process(const ScanBundle& bundle, EstimateSink& sink) {
  const Stopwatch step;
  mixture_.process(bundle);
  Estimate causal;
  causal.time = bundle.scan.end;
  set_estimate(mixture_.components(), causal);
  matching_.report(matching_.match(bundle, causal.state), causal.state.T_map_imu, causal.diagnostics);
  causal.diagnostics.wheel_weight = mixture_.wheel_weight();
  past_.add(mixture_.increment(), mixture_.components());
  causal.diagnostics.step_ms = step.elapsed_ms();
  sink.causal(causal);
  causal_.push_back(causal);
  const auto older_than = [&](double age_s) {
    return static_cast<std::size_t>(std::count_if(causal_.begin(), causal_.end(), [&](const Estimate& one) {
      return to_seconds(causal.time - one.time) > age_s;
    }));
  };
  if (older_than(kLag_s + kBlock_s) > 0) report(older_than(kLag_s), older_than(kUnsmoothed_s), sink);
}

void MagneticMixture::finish(EstimateSink& sink) {
  if (!causal_.empty()) report(causal_.size(), causal_.size() - 1, sink);
}

void MagneticMixture::set_estimate(std::span<const PlaceComponent> places, Estimate& estimate) const {
  const NavState& reference =
      std::max_element(places.begin(), places.end(), [](const PlaceComponent& a, const PlaceComponent& b) {
        return a.log_weight < b.log_weight;
      })->state;
  Vector17 mean = Vector17::Zero();
  double near = 0.0, all = 0.0;
  for (const PlaceComponent& one : places) {
    const double weight = std::exp(one.log_weight);
    all += weight;
    const Vector17 step = one.state.boxminus(reference);
    if (!(step.segment<3>(tangent::position).norm() < kOnePlace_m)) continue;
    mean += weight * step;
    near += weight;
  }
  estimate.state = reference.boxplus(mean / near);
  estimate.covariance.setZero();
  for (const PlaceComponent& one : places) {
    const Vector6 apart = one.state.T_map_imu.boxminus(estimate.state.T_map_imu);
    estimate.covariance +=
        std::exp(one.log_weight) / all * (one.covariance.topLeftCorner<6, 6>() + apart * apart.transpose());
  }
  const Vector3 late_m = input_.suite.calibration.magnetometers.clock_sigma_s * estimate.state.velocity;
  estimate.covariance.bottomRightCorner<3, 3>() += late_m * late_m.transpose();
}

void MagneticMixture::report(std::size_t count, std::size_t last, EstimateSink& sink) {
  for (const std::vector<PlaceComponent>& places : past_.take(count, last)) {
    Estimate best = causal_.front();
    set_estimate(places, best);
    sink.best(best);
    causal_.pop_front();
  }
}

}  // namespace lodestone

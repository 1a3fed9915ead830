#include "estimators/baselines/magnetic_stochastic/magnetic_stochastic_filter.h"

#include "core/imu/gap_noise.h"
#include "core/stopwatch.h"
#include "estimators/baselines/dead_reckoning.h"
#include "estimators/baselines/magnetic_stochastic/distribution_fit.h"
#include "estimators/initial_state.h"

namespace lodestone {

namespace {

constexpr std::uint64_t kStochasticSeed = 1;

}  // namespace

MagneticStochasticFilter::MagneticStochasticFilter(EstimatorInput input, const StochasticOptions& options)
    : input_(std::move(input)), options_(options), matching_(input_), random_(kStochasticSeed, "samples") {}

void MagneticStochasticFilter::process(const ScanBundle& bundle, EstimateSink& sink) {
  const Stopwatch step;
  if (!started_) {
    const InitialState initial =
        initial_state(input_.initial_pose, input_.initial_velocity, input_.suite.gravity_m_s2, input_.options.initial);
    cloud_ = StateCloud(initial.state, initial.covariance);
    started_ = true;
  }
  Estimate found;
  found.time = bundle.scan.end;
  cloud_.propagate(bundle.imu, with_gap(input_.suite.imu, bundle.imu_gap_s));
  update_by_wheels(bundle, input_.suite, cloud_.covariance(), cloud_, found.diagnostics);
  if (!matching_.observes_height()) {
    update_by_height(input_.suite, input_.field->grid().heights_m.front(), cloud_);
  }
  const MatchedScan scan = matching_.match(bundle, cloud_.nominal());
  if (!scan.arrays.empty()) {
    match(scan);
    found.diagnostics.iterations = options_.iterations;
  }
  found.state = cloud_.nominal();
  found.covariance = cloud_.covariance().topLeftCorner<6, 6>();
  matching_.report(scan, found.state.T_map_imu, found.diagnostics);
  found.diagnostics.step_ms = step.elapsed_ms();
  sink.causal(found);
  sink.best(found);
}

void MagneticStochasticFilter::match(const MatchedScan& scan) {
  const NavState& predicted = cloud_.nominal();
  const StateCloud::Regression seen = field_regression(cloud_, matching_.observes_height());
  const auto cost = [&](const Eigen::VectorXd& n) {
    return -matching_.log_likelihood(scan, predicted.boxplus(seen.gain * n).T_map_imu);
  };
  const FittedDistribution fitted = fit_distribution(seen.root, cost, options_.samples, options_.iterations, random_);
  cloud_.replace_covariance(seen, fitted.covariance);
  const NavState state = predicted.boxplus(seen.gain * fitted.mean);
  cloud_.states.front().state = state;
  cloud_.set_nominal(state);
}

void MagneticStochasticFilter::finish(EstimateSink&) {}

}  // namespace lodestone

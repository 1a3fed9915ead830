#include "estimators/baselines/magnetic_particle/magnetic_particle_filter.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "core/imu/gap_noise.h"
#include "core/parallel.h"
#include "core/stopwatch.h"
#include "estimators/baselines/dead_reckoning.h"
#include "estimators/initial_state.h"

namespace lodestone {

namespace {

constexpr std::uint64_t kParticleSeed = 1;

/// Smallest number of particles that is worth a piece of parallel work.
constexpr std::size_t kParticlesAPiece = 64;

}  // namespace

MagneticParticleFilter::MagneticParticleFilter(EstimatorInput input, const ParticleOptions& options)
    : input_(std::move(input)), options_(options), matching_(input_), random_(kParticleSeed, "particles") {}

void MagneticParticleFilter::start() {
  const InitialState initial =
      initial_state(input_.initial_pose, input_.initial_velocity, input_.suite.gravity_m_s2, input_.options.initial);
  cloud_ = StateCloud(initial.state, initial.covariance);
  cloud_.states.resize(static_cast<std::size_t>(options_.max_particles), cloud_.states.front());
  draw();
}

void MagneticParticleFilter::draw() {
  const StateCloud::Regression seen = field_regression(cloud_, matching_.observes_height());
  const Eigen::MatrixXd spread = seen.gain * seen.root;
  Eigen::VectorXd standard(seen.dimensions());
  for (WeightedState& particle : cloud_.states) {
    for (double& number : standard) number = random_.normal();
    particle.state = particle.state.boxplus(cloud_.turned(spread * standard, particle.state));
  }
  cloud_.replace_covariance(seen, Eigen::MatrixXd::Zero(seen.dimensions(), seen.dimensions()));
}

void MagneticParticleFilter::process(const ScanBundle& bundle, EstimateSink& sink) {
  const Stopwatch step;
  if (!started_) start();
  started_ = true;
  cloud_.propagate(bundle.imu, with_gap(input_.suite.imu, bundle.imu_gap_s));
  draw();

  Diagnostics diagnostics;
  if (input_.suite.wheels) update_by_wheels(bundle, input_.suite, total_covariance(), cloud_, diagnostics);
  if (!matching_.observes_height()) {
    update_by_height(input_.suite, input_.field->grid().heights_m.front(), cloud_);
  }
  const MatchedScan scan = matching_.match(bundle, cloud_.nominal());
  std::vector<WeightedState>& particles = cloud_.states;
  parallel_for(
      std::size_t{0}, particles.size(),
      [&](std::size_t i) { particles[i].log_weight += matching_.log_likelihood(scan, particles[i].state.T_map_imu); },
      kParticlesAPiece);

  const std::vector<double> weights = cloud_.weights();
  Estimate found = estimate(weights);
  found.time = bundle.scan.end;
  found.diagnostics = diagnostics;
  matching_.report(scan, found.state.T_map_imu, found.diagnostics);
  cloud_.set_nominal(found.state);
  if (effective_number(weights) < options_.resample_share * static_cast<double>(particles.size())) resample(weights);
  found.diagnostics.step_ms = step.elapsed_ms();
  sink.causal(found);
  sink.best(found);
}

void MagneticParticleFilter::finish(EstimateSink&) {}

Estimate MagneticParticleFilter::estimate(const std::vector<double>& weights) {
  const ParticleModes modes = find_modes(cloud_.states, options_.bin_m, options_.bin_deg * M_PI / 180.0);
  std::vector<double> of_mode(static_cast<std::size_t>(modes.modes), 0.0);
  for (std::size_t i = 0; i < weights.size(); ++i) of_mode[static_cast<std::size_t>(modes.mode[i])] += weights[i];
  const auto heaviest = std::max_element(of_mode.begin(), of_mode.end());
  std::vector<double> within(weights);
  for (std::size_t i = 0; i < weights.size(); ++i) {
    const bool in = modes.mode[i] == heaviest - of_mode.begin();
    within[i] = in ? weights[i] / *heaviest : 0.0;
  }
  Estimate result;
  result.state = cloud_.mean(within);
  result.covariance = (cloud_.spread(weights, result.state) + cloud_.covariance()).topLeftCorner<6, 6>();
  return result;
}

Matrix17 MagneticParticleFilter::total_covariance() const {
  return cloud_.spread(cloud_.weights(), cloud_.nominal()) + cloud_.covariance();
}

void MagneticParticleFilter::resample(const std::vector<double>& weights) {
  const auto drawn = [&](std::size_t count) {
    std::vector<WeightedState> result;
    for (const std::size_t i : low_variance_draws(weights, count, random_.uniform())) {
      result.push_back({cloud_.states[i].state, 0.0});
    }
    return result;
  };
  // The bins that the distribution occupies, from as many draws as there are particles now.
  const std::size_t bins = find_modes(drawn(weights.size()), options_.bin_m, options_.bin_deg * M_PI / 180.0).bins;
  const double needed = kld_number(bins, options_.kld_error, options_.kld_probability);
  cloud_.states = drawn(static_cast<std::size_t>(std::clamp(
      std::ceil(needed), static_cast<double>(options_.min_particles), static_cast<double>(options_.max_particles))));
  smooth_kernels();
}

void MagneticParticleFilter::smooth_kernels() {
  const ParticleModes modes = find_modes(cloud_.states, options_.bin_m, options_.bin_deg * M_PI / 180.0);
  const double dimensions = matching_.observes_height() ? 4.0 : 3.0;
  for (int mode = 0; mode < modes.modes; ++mode) {
    std::vector<double> weights(cloud_.states.size(), 0.0);
    double count = 0.0;
    for (std::size_t i = 0; i < weights.size(); ++i) count += modes.mode[i] == mode ? 1.0 : 0.0;
    for (std::size_t i = 0; i < weights.size(); ++i) weights[i] = modes.mode[i] == mode ? 1.0 / count : 0.0;
    if (count < 2.0) continue;
    // Silverman's bandwidth for a Gaussian kernel, in sigmas of the mode.
    const double bandwidth = std::pow(4.0 / (count * (dimensions + 2.0)), 1.0 / (dimensions + 4.0));
    const double kept = std::sqrt(1.0 - bandwidth * bandwidth);
    const NavState mean = cloud_.mean(weights);
    const Eigen::SelfAdjointEigenSolver<Matrix17> solver(cloud_.spread(weights, mean));
    const Matrix17 root = solver.eigenvectors() * solver.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal();
    for (std::size_t i = 0; i < weights.size(); ++i) {
      if (weights[i] == 0.0) continue;
      Vector17 standard;
      for (double& number : standard) number = random_.normal();
      NavState& state = cloud_.states[i].state;
      state = mean.boxplus(kept * state.boxminus(mean) + bandwidth * (root * standard));
    }
  }
}

}  // namespace lodestone

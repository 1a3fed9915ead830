#pragma once

#include <vector>

#include "core/random_stream.h"
#include "estimators/baselines/field_matching.h"
#include "estimators/baselines/magnetic_particle/particle_options.h"
#include "estimators/baselines/magnetic_particle/resampling.h"
#include "estimators/baselines/state_cloud.h"

namespace lodestone {

/// Monte Carlo localization of a magnetometer array on a field map (docs/design/053-magnetic-particle.md). A particle
/// is a position and a heading; velocity, biases, roll and pitch are conditionally Gaussian. The IMU predicts, and the
/// wheels where the log has them. The number of particles adapts to the distribution. Several modes are kept; the
/// estimate is the mean of the heaviest one, with the second moments of all particles about it as covariance.
class MagneticParticleFilter final : public Estimator {
 public:
  /// `input` must have a field map. Cloud map and scans are not used.
  MagneticParticleFilter(EstimatorInput input, const ParticleOptions& options);

  void process(const ScanBundle& bundle, EstimateSink& sink) override;
  void finish(EstimateSink& sink) override;

 private:
  void start();
  /// Draws what the field observes of each particle, given its past.
  void draw();
  Estimate estimate(const std::vector<double>& weights);
  void resample(const std::vector<double>& weights);
  /// Kernel smoothing with shrinkage, in each mode (Liu and West 2001).
  void smooth_kernels();
  Matrix17 total_covariance() const;

  EstimatorInput input_;
  ParticleOptions options_;
  FieldMatching matching_;
  RandomStream random_;
  bool started_ = false;
  StateCloud cloud_;
};

}  // namespace lodestone

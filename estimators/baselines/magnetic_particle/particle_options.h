#pragma once

#include "core/option_checks.h"

namespace lodestone {

/// Options of estimator magnetic-particle. Sources: docs/design/053-magnetic-particle.md.
struct ParticleOptions {
  int min_particles = 500;
  int max_particles = 5000;
  double kld_error = 0.05;
  double kld_probability = 0.99;
  double bin_m = 0.1;
  double bin_deg = 5.0;
  double resample_share = 0.5;

  template <class Visitor>
  void visit(Visitor& visitor) {
    visitor.field("min_particles", min_particles, "least number of particles");
    visitor.field("max_particles", max_particles, "largest number of particles, and the number at the beginning");
    visitor.field("kld_error", kld_error,
                  "the number of particles bounds the Kullback-Leibler distance between particles and distribution by "
                  "this value");
    visitor.field("kld_probability", kld_probability, "probability of that bound");
    visitor.field("bin_m", bin_m, "side of the bins in x and y, whose number determines the number of particles");
    visitor.field("bin_deg", bin_deg, "size of the bins in heading");
    visitor.field("resample_share", resample_share,
                  "particles are resampled if the effective number is below this share of all");
  }

  void check() const {
    option_checks::within("min_particles", min_particles, 10, 1000000);
    option_checks::within("max_particles", max_particles, min_particles, 1000000);
    option_checks::within("kld_error", kld_error, 1e-4, 1.0);
    option_checks::within("kld_probability", kld_probability, 0.5, 1.0 - 1e-9);
    option_checks::within("bin_m", bin_m, 1e-3, 100.0);
    option_checks::within("bin_deg", bin_deg, 0.1, 180.0);
    option_checks::within("resample_share", resample_share, 0.0, 1.0);
  }
};

}  // namespace lodestone

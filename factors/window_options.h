#pragma once

#include "core/option_checks.h"
#include "core/options.h"

namespace lodestone {

struct SlidingWindowOptions {
  int max_iterations = 4;
  bool condensed = true;
  bool magnetometer_bias_states = true;
  double magnetometer_bias_sigma_ut = 0.5;
  double magnetometer_bias_walk_ut = 0.02;
  double magnetometer_bias_epoch_s = 5.0;
  bool magnetometer_bias_jumps = true;
  bool map_error_states = true;

  template <class Visitor>
  void visit(Visitor& visitor) {
    visitor.field("max_iterations", max_iterations, "largest number of iterations of one solve");
    visitor.field("condensed", condensed, "condense each scan to 25 residuals; false: one residual per point");
    visitor.field("magnetometer_bias_states", magnetometer_bias_states, "estimate the bias of each magnetometer");
    visitor.field("magnetometer_bias_sigma_ut", magnetometer_bias_sigma_ut, "initial sigma of each bias, µT");
    visitor.field("magnetometer_bias_walk_ut", magnetometer_bias_walk_ut, "drift of each bias, µT/√s");
    visitor.field("magnetometer_bias_epoch_s", magnetometer_bias_epoch_s, "time over which a bias is constant");
    visitor.field("magnetometer_bias_jumps", magnetometer_bias_jumps,
                  "allow jumps and fast drift of a bias if the readings require them");
    visitor.field("map_error_states", map_error_states, "estimate the error of the cloud map that nearby scans share");
  }

  void check() const {
    option_checks::within("max_iterations", max_iterations, 1, 1000);
    option_checks::positive("magnetometer_bias_sigma_ut", magnetometer_bias_sigma_ut);
    option_checks::positive("magnetometer_bias_walk_ut", magnetometer_bias_walk_ut);
    option_checks::positive("magnetometer_bias_epoch_s", magnetometer_bias_epoch_s);
  }
};

}  // namespace lodestone

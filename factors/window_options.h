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
    visitor.field("max_iterations", max_iterations, "iterations of one solve");
    visitor.field("condensed", condensed, "a scan as thirteen residuals; false: one residual a point");
    visitor.field("magnetometer_bias_states", magnetometer_bias_states, "estimate a bias of each magnetometer");
    visitor.field("magnetometer_bias_sigma_ut", magnetometer_bias_sigma_ut, "one sigma of each bias at the start");
    visitor.field("magnetometer_bias_walk_ut", magnetometer_bias_walk_ut, "drift of each bias, µT/√s");
    visitor.field("magnetometer_bias_epoch_s", magnetometer_bias_epoch_s, "a bias is constant for so long");
    visitor.field("magnetometer_bias_jumps", magnetometer_bias_jumps,
                  "a bias may also jump or drift fast where the readings insist on it");
    visitor.field("map_error_states", map_error_states,
                  "estimate the error of the cloud map that scans near each other share");
  }

  void check() const {
    option_checks::within("max_iterations", max_iterations, 1, 1000);
    option_checks::positive("magnetometer_bias_sigma_ut", magnetometer_bias_sigma_ut);
    option_checks::positive("magnetometer_bias_walk_ut", magnetometer_bias_walk_ut);
    option_checks::positive("magnetometer_bias_epoch_s", magnetometer_bias_epoch_s);
  }
};

}  // namespace lodestone

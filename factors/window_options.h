#pragma once

#include "core/options.h"

namespace lodestone {

struct SlidingWindowOptions {
  bool condensed = true;
  bool magnetometer_bias_states = true;
  bool map_error_states = true;

  // Set by code alone; no keys.
  int max_iterations = 4;                  ///< of one solve
  double magnetometer_bias_epoch_s = 5.0;  ///< a bias is constant for so long (docs/design/016-magnetometer-biases.md)

  template <class Visitor>
  void visit(Visitor& visitor) {
    visitor.field("condensed", condensed, "condense each scan to 25 residuals; false: one residual per point");
    visitor.field("magnetometer_bias_states", magnetometer_bias_states, "estimate the bias of each magnetometer");
    visitor.field("map_error_states", map_error_states, "estimate the error of the cloud map that nearby scans share");
  }
};

}  // namespace lodestone

#pragma once

#include "core/option_checks.h"

namespace lodestone {

/// Options of the estimator magnetic-calibrating (docs/design/055-magnetic-calibrating.md).
struct MagneticCalibratingOptions {
  double window_s = 2.5;
  int alternations = 10;

  template <class Visitor>
  void visit(Visitor& visitor) {
    visitor.field("window_s", window_s, "length of the sliding window, which is the lag of the smoothed output");
    visitor.field("alternations", alternations,
                  "largest number of rounds per scan; a round localizes the window, then calibrates the magnetometers");
  }

  void check() const {
    option_checks::within("window_s", window_s, 0.0, 60.0);
    option_checks::within("alternations", alternations, 1, 100);
  }
};

}  // namespace lodestone

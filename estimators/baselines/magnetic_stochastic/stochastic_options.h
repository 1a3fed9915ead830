#pragma once

#include "core/option_checks.h"

namespace lodestone {

/// Options of estimator magnetic-stochastic. Sources: docs/design/054-magnetic-stochastic.md.
struct StochasticOptions {
  int samples = 400;
  int iterations = 4;

  template <class Visitor>
  void visit(Visitor& visitor) {
    visitor.field("samples", samples, "number of samples of the pose in each iteration");
    visitor.field("iterations", iterations, "number of iterations in each scan");
  }

  void check() const {
    option_checks::within("samples", samples, 20, 1000000);
    option_checks::within("iterations", iterations, 1, 100);
  }
};

}  // namespace lodestone

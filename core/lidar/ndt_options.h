#pragma once

#include "core/option_checks.h"
#include "core/options.h"

namespace lodestone {

/// Registration by the normal distributions transform. Defaults: hdl_localization (docs/design/056-ndt.md).
struct NdtOptions {
  double cell_m = 1.0;
  double thinning_m = 0.1;

  template <class Visitor>
  void visit(Visitor& visitor) {
    visitor.field("cell_m", cell_m, "edge of a cell of the map; each cell has one normal distribution");
    visitor.field("thinning_m", thinning_m,
                  "cloud map and scans are reduced to one point, the mean, in each voxel of this edge");
  }

  void check() const {
    option_checks::within("cell_m", cell_m, 0.1, 100.0);
    option_checks::within("thinning_m", thinning_m, 0.01, cell_m);
  }
};

}  // namespace lodestone

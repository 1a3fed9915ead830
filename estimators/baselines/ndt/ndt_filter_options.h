#pragma once

#include "core/lidar/ndt_options.h"

namespace lodestone {

/// The estimator `ndt` (docs/design/056-ndt.md).
struct NdtFilterOptions {
  NdtOptions registration;
  double pose_time = 0.5;

  template <class Visitor>
  void visit(Visitor& visitor) {
    visitor.section("registration", registration);
    visitor.field("pose_time", pose_time,
                  "time of the registered pose within the scan, which is not deskewed: 0 is the first point's time, 1 "
                  "the last one's");
  }

  void check() const { option_checks::within("pose_time", pose_time, 0.0, 1.0); }
};

}  // namespace lodestone

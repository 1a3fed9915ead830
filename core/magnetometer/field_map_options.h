#pragma once

#include <cstddef>

#include "core/option_checks.h"
#include "core/options.h"

namespace lodestone {

/// Memory of a magnetic map during a run.
struct FieldMapOptions {
  double max_memory_mb = 64.0;

  template <class Visitor>
  void visit(Visitor& visitor) {
    visitor.field(
        "max_memory_mb", max_memory_mb,
        "most of the magnetic map's tiles in memory; those round the robot are read from its file, the others go. "
        "The results are the same");
  }

  void check() const { option_checks::within("max_memory_mb", max_memory_mb, 0.0, 1e6); }

  std::size_t max_bytes() const { return static_cast<std::size_t>(max_memory_mb * 1048576.0); }
};

}  // namespace lodestone

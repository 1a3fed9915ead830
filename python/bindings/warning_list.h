#pragma once

#include "bindings/bindings.h"
#include "core/warnings.h"

namespace lodestone::python {

/// Warnings as tuples (kind, count, detail, first_ns, last_ns), in order of kind.
inline py::list list_of(const WarningLog& warnings) {
  py::list rows;
  for (const auto& [kind, entry] : warnings.entries()) {
    rows.append(py::make_tuple(kind, entry.count, entry.first_detail, entry.first_time, entry.last_time));
  }
  return rows;
}

}  // namespace lodestone::python

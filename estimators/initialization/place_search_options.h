#pragma once

#include "core/option_checks.h"

namespace lodestone {

/// How a start anywhere on the map is looked for, and when it counts as found.
struct PlaceSearchOptions {
  double data_s = 5.0;
  double min_probability = 0.99;
  int max_nodes = 4000000;

  template <class Visitor>
  void visit(Visitor& visitor) {
    visitor.field("data_s", data_s, "at most so much of the log's beginning is looked at");
    visitor.field(
        "min_probability", min_probability,
        "a place less probable than this, among all candidates and 'nowhere on the map', is refused; lower it to "
        "go on with the best");
    visitor.field("max_nodes", max_nodes,
                  "the search ends after so many blocks of places; what it leaves out counts as doubt");
  }

  void check() const {
    option_checks::within("data_s", data_s, 0.1, 60.0);
    option_checks::within("min_probability", min_probability, 0.0, 1.0);
    option_checks::within("max_nodes", max_nodes, 1000, 2000000000);
  }
};

}  // namespace lodestone

#pragma once

#include "core/option_checks.h"

namespace lodestone {

/// Options of the search of the initial pose on the whole map, and of its acceptance.
struct PlaceSearchOptions {
  double data_s = 5.0;
  double min_probability = 0.99;
  int max_nodes = 4000000;

  template <class Visitor>
  void visit(Visitor& visitor) {
    visitor.field("data_s", data_s, "length of the log that is used, from its begin, at most");
    visitor.field(
        "min_probability", min_probability,
        "the best place is rejected if its probability, among all candidates and 'nowhere on the map', is smaller; "
        "lower it to accept the best place");
    visitor.field("max_nodes", max_nodes,
                  "the search stops after this number of blocks of places; its result is then not accepted");
  }

  void check() const {
    option_checks::within("data_s", data_s, 0.1, 60.0);
    option_checks::within("min_probability", min_probability, 0.0, 1.0);
    option_checks::within("max_nodes", max_nodes, 1000, 2000000000);
  }
};

}  // namespace lodestone

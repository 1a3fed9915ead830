#pragma once

#include "core/option_checks.h"

namespace lodestone {

/// Options of the search of the initial pose on the whole map, and of its acceptance.
struct PlaceSearchOptions {
  double data_s = 5.0;
  double min_probability = 0.99;
  double yaw_step_deg = 1.0;
  double range_m = 40.0;
  int points = 500;
  int candidates = 250;
  int field_candidates = 100;
  int max_nodes = 4000000;
  double independent_points = 60.0;
  double independent_distance_m = 1.0;
  double field_trust = 0.5;
  double stale_share = 0.05;
  double field_correlation_m = 0.3;
  double position_sigma_m = 0.03;

  template <class Visitor>
  void visit(Visitor& visitor) {
    visitor.field("data_s", data_s, "length of the log that is used, from its begin, at most");
    visitor.field(
        "min_probability", min_probability,
        "the best place is rejected if its probability, among all candidates and 'nowhere on the map', is smaller; "
        "lower it to accept the best place");
    visitor.field("yaw_step_deg", yaw_step_deg, "step between the headings of the search");
    visitor.field("range_m", range_m, "points farther from the robot are ignored by the search");
    visitor.field("points", points, "number of points of the scan that the search uses, evenly distributed");
    visitor.field("candidates", candidates, "largest number of candidates from the search over the cloud map");
    visitor.field("field_candidates", field_candidates,
                  "largest number of candidates from the search over the magnetic map");
    visitor.field("max_nodes", max_nodes,
                  "the search stops after this number of blocks of places; its result is then not accepted");
    visitor.field("independent_points", independent_points,
                  "a scan counts as this number of independent points, since neighbours lie on the same surface");
    visitor.field("independent_distance_m", independent_distance_m,
                  "scans at this distance from each other count as independent");
    visitor.field("field_trust", field_trust, "exponent of the field's likelihood, since its errors are correlated");
    visitor.field("stale_share", stale_share, "share of the magnetic map that may have changed since the survey");
    visitor.field("field_correlation_m", field_correlation_m, "correlation length of the magnetic map's errors");
    visitor.field(
        "position_sigma_m", position_sigma_m,
        "position error of a registered candidate; its product with the field's gradient is an error of the field");
  }

  void check() const {
    option_checks::within("data_s", data_s, 0.1, 60.0);
    option_checks::within("min_probability", min_probability, 0.0, 1.0);
    option_checks::within("yaw_step_deg", yaw_step_deg, 0.1, 30.0);
    option_checks::positive("range_m", range_m);
    option_checks::within("points", points, 10, 100000);
    option_checks::within("candidates", candidates, 1, 100000);
    option_checks::within("field_candidates", field_candidates, 0, 100000);
    option_checks::within("max_nodes", max_nodes, 1000, 2000000000);
    option_checks::positive("independent_points", independent_points);
    option_checks::positive("independent_distance_m", independent_distance_m);
    option_checks::within("field_trust", field_trust, 0.0, 1.0);
    option_checks::within("stale_share", stale_share, 1e-6, 0.999);
    option_checks::positive("field_correlation_m", field_correlation_m);
    option_checks::not_negative("position_sigma_m", position_sigma_m);
  }
};

}  // namespace lodestone

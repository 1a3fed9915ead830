#pragma once

#include "core/option_checks.h"

namespace lodestone {

/// How a start anywhere on the map is looked for, and when it counts as found.
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
    visitor.field("data_s", data_s, "at most so much of the log's beginning is looked at");
    visitor.field(
        "min_probability", min_probability,
        "a place less probable than this, among all candidates and 'nowhere on the map', is refused; lower it to "
        "go on with the best");
    visitor.field("yaw_step_deg", yaw_step_deg, "headings tried in the search");
    visitor.field("range_m", range_m, "points farther from the robot do not take part in the search");
    visitor.field("points", points, "of the scan that take part in the search, spread evenly");
    visitor.field("candidates", candidates, "places that the search over the cloud map hands on");
    visitor.field("field_candidates", field_candidates, "places that the search over the magnetic map hands on");
    visitor.field("max_nodes", max_nodes,
                  "the search ends after so many blocks of places; what it leaves out counts as doubt");
    visitor.field("independent_points", independent_points,
                  "a scan says as much as so many independent points: neighbours lie on the same surface");
    visitor.field("independent_distance_m", independent_distance_m,
                  "the next scan says something new after such a way");
    visitor.field("field_trust", field_trust, "power of the field's likelihood: its errors are correlated");
    visitor.field("stale_share", stale_share, "share of the magnetic map that may have changed since the survey");
    visitor.field("field_correlation_m", field_correlation_m, "errors of the magnetic map are one over this distance");
    visitor.field("position_sigma_m", position_sigma_m,
                  "of a candidate once it is registered: the field's gradient times this");
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

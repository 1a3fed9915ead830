#pragma once

#include "core/option_checks.h"
#include "core/options.h"

namespace lodestone {

/// What is believed before the log has a say, and how it is weighed.
struct CalibrationOptions {
  double hard_iron_sigma_ut = 20.0;
  double soft_iron_sigma = 0.05;
  double misalignment_sigma_deg = 2.0;
  double min_gain = 0.5;
  double gyroscope_bias_sigma_rad_s = 0.01;
  double max_walk_ut_sqrt_s = 1.0;
  double map_correlation_m = 0.3;
  double map_sigma_floor_ut = 0.2;
  double position_sigma_m = 0.02;
  double rotation_sigma_deg = 0.2;
  double huber_sigma = 3.5;
  int max_moments = 3000;
  int max_rounds = 8;

  template <class Visitor>
  void visit(Visitor& visitor) {
    visitor.field("hard_iron_sigma_ut", hard_iron_sigma_ut, "prior of each magnetometer's offset, a component");
    visitor.field("soft_iron_sigma", soft_iron_sigma,
                  "prior of each of the six numbers of scale and soft iron, a share of the field");
    visitor.field("misalignment_sigma_deg", misalignment_sigma_deg,
                  "prior of each magnetometer's turn against the platform file, an axis");
    visitor.field(
        "min_gain", min_gain,
        "a direction of the parameters whose prior variance the log shrinks by a smaller share is held at its prior");
    visitor.field("gyroscope_bias_sigma_rad_s", gyroscope_bias_sigma_rad_s,
                  "without a map: of the gyroscope's bias, an axis");
    visitor.field("max_walk_ut_sqrt_s", max_walk_ut_sqrt_s,
                  "without a map: where the field about the robot changes faster, only offsets are looked for");
    visitor.field("map_correlation_m", map_correlation_m,
                  "with a map: its error is one and the same over this distance");
    visitor.field("map_sigma_floor_ut", map_sigma_floor_ut, "with a map: least sigma of it");
    visitor.field("position_sigma_m", position_sigma_m, "with a map: of the trajectory, an axis");
    visitor.field("rotation_sigma_deg", rotation_sigma_deg, "with a map: of the trajectory, an axis");
    visitor.field("huber_sigma", huber_sigma, "readings further than so many sigmas off are weighed down");
    visitor.field("max_moments", max_moments, "most moments of the log that are used, evenly spread");
    visitor.field("max_rounds", max_rounds, "most rounds of solving and weighing anew");
  }

  void check() const {
    option_checks::positive("hard_iron_sigma_ut", hard_iron_sigma_ut);
    option_checks::positive("soft_iron_sigma", soft_iron_sigma);
    option_checks::positive("misalignment_sigma_deg", misalignment_sigma_deg);
    option_checks::within("min_gain", min_gain, 0.01, 0.99);
    option_checks::positive("gyroscope_bias_sigma_rad_s", gyroscope_bias_sigma_rad_s);
    option_checks::positive("max_walk_ut_sqrt_s", max_walk_ut_sqrt_s);
    option_checks::positive("map_correlation_m", map_correlation_m);
    option_checks::positive("map_sigma_floor_ut", map_sigma_floor_ut);
    option_checks::not_negative("position_sigma_m", position_sigma_m);
    option_checks::not_negative("rotation_sigma_deg", rotation_sigma_deg);
    option_checks::positive("huber_sigma", huber_sigma);
    option_checks::within("max_moments", max_moments, 20, 100000);
    option_checks::within("max_rounds", max_rounds, 1, 50);
  }
};

}  // namespace lodestone

#pragma once

#include "core/option_checks.h"
#include "core/options.h"

namespace lodestone {

/// Priors and weights of the calibration.
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
    visitor.field("hard_iron_sigma_ut", hard_iron_sigma_ut, "prior sigma of each magnetometer's offset, per component");
    visitor.field("soft_iron_sigma", soft_iron_sigma,
                  "prior sigma of each of the six parameters of scale and soft iron, as a share of the field");
    visitor.field("misalignment_sigma_deg", misalignment_sigma_deg,
                  "prior sigma of each magnetometer's rotation against the platform file, per axis");
    visitor.field(
        "min_gain", min_gain,
        "a direction of the parameters is kept at its prior if the log reduces its prior variance by a smaller share");
    visitor.field("gyroscope_bias_sigma_rad_s", gyroscope_bias_sigma_rad_s,
                  "without a map: prior sigma of the gyroscope bias, per axis");
    visitor.field("max_walk_ut_sqrt_s", max_walk_ut_sqrt_s,
                  "without a map: if the field around the robot changes faster, only offsets are estimated");
    visitor.field("map_correlation_m", map_correlation_m, "with a map: correlation length of its error");
    visitor.field("map_sigma_floor_ut", map_sigma_floor_ut, "with a map: its smallest sigma");
    visitor.field("position_sigma_m", position_sigma_m, "with a map: sigma of the trajectory's position, per axis");
    visitor.field("rotation_sigma_deg", rotation_sigma_deg, "with a map: sigma of the trajectory's attitude, per axis");
    visitor.field("huber_sigma", huber_sigma, "readings with larger residuals, in sigmas, get less weight");
    visitor.field("max_moments", max_moments, "largest number of moments of the log that are used, evenly distributed");
    visitor.field("max_rounds", max_rounds, "largest number of rounds of solution and weighting");
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

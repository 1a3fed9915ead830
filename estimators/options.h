#pragma once

#include <string>

#include "core/evaluation/stale_map.h"
#include "core/lidar/association.h"
#include "core/lidar/plane_map.h"
#include "core/lidar/scan_sampling.h"
#include "core/magnetometer/field_map_options.h"
#include "core/magnetometer/magnetic_map.h"
#include "core/observability/degeneracy.h"
#include "core/option_checks.h"
#include "core/options.h"
#include "estimators/initialization/place_search_options.h"
#include "factors/window_options.h"

namespace lodestone {

/// How well the start is known: one sigma each.
struct InitialOptions {
  double position_sigma_m = 0.1;
  double rotation_sigma_deg = 1.0;
  double velocity_sigma_m_s = 0.3;
  double gyroscope_bias_sigma_rad_s = 0.02;
  double accelerometer_bias_sigma_m_s2 = 0.1;
  double gravity_sigma_deg = 0.5;
  double search_m = 0.75;
  double search_deg = 7.5;

  template <class Visitor>
  void visit(Visitor& visitor) {
    visitor.field("position_sigma_m", position_sigma_m, "of the initial position, each axis");
    visitor.field("rotation_sigma_deg", rotation_sigma_deg, "of the initial attitude, each axis");
    visitor.field("velocity_sigma_m_s", velocity_sigma_m_s, "of the initial velocity, which is taken as zero");
    visitor.field("gyroscope_bias_sigma_rad_s", gyroscope_bias_sigma_rad_s, "of the gyroscope's bias, taken as zero");
    visitor.field("accelerometer_bias_sigma_m_s2", accelerometer_bias_sigma_m_s2,
                  "of the accelerometer's bias, taken as zero");
    visitor.field("gravity_sigma_deg", gravity_sigma_deg, "tilt of gravity against the map's z axis");
    visitor.field(
        "search_m", search_m,
        "where first scan and field do not fit at the given start, one is looked for so far around it; 0: never");
    visitor.field("search_deg", search_deg, "and turned by so much about the vertical");
  }

  void check() const {
    option_checks::positive("position_sigma_m", position_sigma_m);
    option_checks::positive("rotation_sigma_deg", rotation_sigma_deg);
    option_checks::positive("velocity_sigma_m_s", velocity_sigma_m_s);
    option_checks::positive("gyroscope_bias_sigma_rad_s", gyroscope_bias_sigma_rad_s);
    option_checks::positive("accelerometer_bias_sigma_m_s2", accelerometer_bias_sigma_m_s2);
    option_checks::positive("gravity_sigma_deg", gravity_sigma_deg);
    option_checks::within("search_m", search_m, 0.0, 5.0);
    option_checks::within("search_deg", search_deg, 0.0, 45.0);
  }
};

struct LidarOptions {
  ScanSamplingOptions sampling;
  AssociationOptions association;
  PlaneMapOptions map;

  template <class Visitor>
  void visit(Visitor& visitor) {
    visitor.section("sampling", sampling);
    visitor.section("association", association);
    visitor.section("map", map);
  }
};

/// How a magnetic measurement is held back where LiDAR sees every direction.
enum class MagneticShrink {
  none,        ///< full weight
  residual,    ///< the paper: β on the residual, the information stays (docs/design/architecture.md)
  information  ///< β² on the whole factor
};

constexpr auto enum_names(MagneticShrink) {
  return EnumNames<MagneticShrink, 3>{{{MagneticShrink::none, "none"},
                                       {MagneticShrink::residual, "residual"},
                                       {MagneticShrink::information, "information"}}};
}

/// What the smoother's window takes from the magnetometers.
enum class MagneticMeasurement {
  field,  ///< every reading against the map, linearized anew as the pose moves
  pose    ///< the paper: the pose at which an array sample fits the map, found by Gauss-Newton, with its information
};

constexpr auto enum_names(MagneticMeasurement) {
  return EnumNames<MagneticMeasurement, 2>{
      {{MagneticMeasurement::field, "field"}, {MagneticMeasurement::pose, "pose"}}};
}

struct MagneticOptions {
  std::string magnetometers = "all";
  MagneticMeasurement measurement = MagneticMeasurement::field;
  FieldInterpolation interpolation = FieldInterpolation::bicubic;
  MagneticShrink shrink = MagneticShrink::information;
  double beta = 0.7;
  bool monitor = true;
  bool huber = true;
  double huber_probability = 0.95;
  double huber_power = 2.0;
  double sensor_probability = 0.9999;
  bool map_sigma = true;
  double map_correlation_m = -1.0;
  int samples_per_reading = 5;
  FieldMapOptions map;

  template <class Visitor>
  void visit(Visitor& visitor) {
    visitor.field(
        "magnetometers", magnetometers,
        "all, a number (that many, spread as far as they come), or names of the platform with commas: the others "
        "are not read");
    visitor.field("measurement", measurement,
                  "field or pose: what the smoother's window takes, readings against the map or the poses that "
                  "Gauss-Newton finds for array samples; estimator magnetic always takes poses");
    visitor.field("interpolation", interpolation, "bilinear or bicubic, between the nodes of the field map");
    visitor.field("shrink", shrink, "none, residual or information: how β acts where LiDAR sees every direction");
    visitor.field("beta", beta, "β: how much of a magnetic measurement counts there");
    visitor.field("monitor", monitor,
                  "leave out readings that cannot be measurements: stuck, at the sensor's limit, spikes");
    visitor.field("huber", huber, "weigh down array samples of large Mahalanobis distance");
    visitor.field("huber_probability", huber_probability,
                  "array samples beyond this χ² quantile are weighed down; 0.95 is the paper's c = 3.55 in 6 degrees");
    visitor.field(
        "huber_power", huber_power,
        "the smoother's: they count by (quantile / distance) to this power; 1 is Huber's weight (the paper), 2 nearly "
        "ignores far outliers such as passing steel");
    visitor.field("sensor_probability", sensor_probability,
                  "a magnetometer beyond this χ² quantile of what the rest of the array says is set aside");
    visitor.field("map_sigma", map_sigma, "add the map's posterior sigma to the sensor's noise");
    visitor.field("map_correlation_m", map_correlation_m,
                  "the map's error is one and the same over this distance: samples closer than that share it; below 0: "
                  "as the map states, or 0.1 m if it does not");
    visitor.field("samples_per_reading", samples_per_reading, "neighbouring samples averaged into one (smoother)");
    visitor.section("map", map);
  }

  void check() const {
    option_checks::within("beta", beta, 0.0, 1.0);
    option_checks::within("huber_probability", huber_probability, 0.01, 0.999999);
    option_checks::within("huber_power", huber_power, 1.0, 4.0);
    option_checks::within("sensor_probability", sensor_probability, 0.5, 1.0 - 1e-12);
    option_checks::within("map_correlation_m", map_correlation_m, -1.0, 1e6);
    option_checks::within("samples_per_reading", samples_per_reading, 1, 1000);
  }
};

/// What becomes of a run once the window has passed over the log.
enum class Refinement {
  none,  ///< nothing: the window's estimates are the result
  batch  ///< the whole log is solved together
};

constexpr auto enum_names(Refinement) {
  return EnumNames<Refinement, 2>{{{Refinement::none, "none"}, {Refinement::batch, "batch"}}};
}

struct SmootherOptions {
  double window_s = 2.5;
  int reassociations = 1;
  Refinement refine = Refinement::none;
  SlidingWindowOptions solver;

  template <class Visitor>
  void visit(Visitor& visitor) {
    visitor.field("window_s", window_s, "length of the sliding window: the lag of the smoothed output");
    visitor.field("reassociations", reassociations, "how often a step looks for correspondences again after solving");
    visitor.field("refine", refine, "none or batch: solve the whole log together at its end (--refine)");
    visitor.section("solver", solver);
  }

  void check() const {
    option_checks::within("window_s", window_s, 0.0, 60.0);
    option_checks::within("reassociations", reassociations, 0, 20);
  }
};

struct FilterOptions {
  int lidar_iterations = 4;
  FieldInterpolation interpolation = FieldInterpolation::bilinear;
  MagneticShrink shrink = MagneticShrink::residual;
  double beta = 0.3;
  double map_error_repeats = 30.0;
  bool deskewing_errors = false;
  DegeneracyOptions degeneracy = paper_degeneracy();

  static DegeneracyOptions paper_degeneracy() {
    DegeneracyOptions options;
    options.rule = DegeneracyRule::paper;
    return options;
  }

  template <class Visitor>
  void visit(Visitor& visitor) {
    visitor.field("lidar_iterations", lidar_iterations,
                  "iterations of the LiDAR update, each with new correspondences");
    visitor.field("interpolation", interpolation, "bilinear (the paper) or bicubic");
    visitor.field("shrink", shrink, "residual (the paper), information or none");
    visitor.field("beta", beta, "in place of magnetic.beta: the paper's");
    visitor.field("map_error_repeats", map_error_repeats,
                  "in place of lidar.association.map_error_repeats: the filter takes every error for a scan's own");
    visitor.field(
        "deskewing_errors", deskewing_errors,
        "errors of velocity, biases and IMU move the points of a scan, and points correct them; false: as the paper, "
        "points are deskewed exactly");
    visitor.section("degeneracy", degeneracy);
  }

  void check() const {
    option_checks::within("beta", beta, 0.0, 1.0);
    option_checks::not_negative("map_error_repeats", map_error_repeats);
    option_checks::within("lidar_iterations", lidar_iterations, 1, 100);
  }
};

/// What is looked for in a finished run.
struct ReportOptions {
  StaleMapOptions stale_map;

  template <class Visitor>
  void visit(Visitor& visitor) {
    visitor.section("stale_map", stale_map);
  }
};

/// Everything that a run can be told, by key. Sections `lidar`, `initial` and most of `magnetic` serve every estimator.
struct RunOptions {
  InitialOptions initial;
  LidarOptions lidar;
  DegeneracyOptions degeneracy;
  MagneticOptions magnetic;
  SmootherOptions smoother;
  FilterOptions ieskf;
  PlaceSearchOptions search;
  ReportOptions report;

  template <class Visitor>
  void visit(Visitor& visitor) {
    visitor.section("initial", initial);
    visitor.section("lidar", lidar);
    visitor.section("degeneracy", degeneracy);
    visitor.section("magnetic", magnetic);
    visitor.section("smoother", smoother);
    visitor.section("ieskf", ieskf);
    visitor.section("search", search);
    visitor.section("report", report);
  }
};

}  // namespace lodestone

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
#include "estimators/baselines/continuous_time/continuous_time_options.h"
#include "estimators/baselines/magnetic_calibrating/magnetic_calibrating_options.h"
#include "estimators/baselines/magnetic_particle/particle_options.h"
#include "estimators/baselines/magnetic_stochastic/stochastic_options.h"
#include "estimators/baselines/ndt/ndt_filter_options.h"
#include "estimators/initialization/place_search_options.h"
#include "factors/window_options.h"

namespace lodestone {

/// Uncertainty of the initial state: one sigma each.
struct InitialOptions {
  double position_sigma_m = 0.1;
  double rotation_sigma_deg = 1.0;
  double velocity_sigma_m_s = 0.3;
  double gyroscope_bias_sigma_rad_s = 0.02;
  double accelerometer_bias_sigma_m_s2 = 0.1;
  double gravity_sigma_deg = 0.5;
  double search_m = 0.75;

  template <class Visitor>
  void visit(Visitor& visitor) {
    visitor.field("position_sigma_m", position_sigma_m, "sigma of the initial position, each axis");
    visitor.field("rotation_sigma_deg", rotation_sigma_deg, "sigma of the initial attitude, each axis");
    visitor.field("velocity_sigma_m_s", velocity_sigma_m_s,
                  "sigma of the initial velocity: that of the trajectory of --initial-pose-from, otherwise zero");
    visitor.field("gyroscope_bias_sigma_rad_s", gyroscope_bias_sigma_rad_s,
                  "sigma of the gyroscope bias, which is assumed to be zero");
    visitor.field("accelerometer_bias_sigma_m_s2", accelerometer_bias_sigma_m_s2,
                  "sigma of the accelerometer bias, which is assumed to be zero");
    visitor.field("gravity_sigma_deg", gravity_sigma_deg, "sigma of the angle between gravity and the map's z axis");
    visitor.field("search_m", search_m,
                  "if the first scan and field do not fit at the initial pose, the best pose within this horizontal "
                  "distance, and within 7.5° about the vertical, is searched; 0: no search");
  }

  void check() const {
    option_checks::positive("position_sigma_m", position_sigma_m);
    option_checks::positive("rotation_sigma_deg", rotation_sigma_deg);
    option_checks::positive("velocity_sigma_m_s", velocity_sigma_m_s);
    option_checks::positive("gyroscope_bias_sigma_rad_s", gyroscope_bias_sigma_rad_s);
    option_checks::positive("accelerometer_bias_sigma_m_s2", accelerometer_bias_sigma_m_s2);
    option_checks::positive("gravity_sigma_deg", gravity_sigma_deg);
    option_checks::within("search_m", search_m, 0.0, 5.0);
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

/// How a magnetic measurement is down-weighted if LiDAR observes all directions.
enum class MagneticShrink {
  none,        ///< full weight
  residual,    ///< the paper: β scales the residual, the information is unchanged (docs/design/architecture.md)
  information  ///< β² scales the whole factor
};

constexpr auto enum_names(MagneticShrink) {
  return EnumNames<MagneticShrink, 3>{{{MagneticShrink::none, "none"},
                                       {MagneticShrink::residual, "residual"},
                                       {MagneticShrink::information, "information"}}};
}

/// The kind of magnetic measurement in the smoother's window.
enum class MagneticMeasurement {
  field,  ///< every reading against the map, relinearized as the pose changes
  pose    ///< the paper: the pose at which an array sample fits the map, by Gauss-Newton, with its information
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
  bool map_sigma = true;
  double map_correlation_m = -1.0;
  int samples_per_reading = 5;
  FieldMapOptions map;

  template <class Visitor>
  void visit(Visitor& visitor) {
    visitor.field("magnetometers", magnetometers,
                  "all, a number (that many magnetometers, as far apart as possible), or names from the platform file, "
                  "separated by commas; the others are ignored");
    visitor.field("measurement", measurement,
                  "field or pose: the smoother's window uses the readings, or the poses that Gauss-Newton finds for "
                  "array samples; estimator magnetic always uses poses");
    visitor.field("interpolation", interpolation,
                  "bilinear or bicubic interpolation between the nodes of the field map");
    visitor.field("shrink", shrink, "none, residual or information: what β scales if LiDAR observes all directions");
    visitor.field("beta", beta, "β: scale of magnetic measurements if LiDAR observes all directions");
    visitor.field("monitor", monitor, "reject invalid readings: stuck, at the sensor's limit, spikes");
    visitor.field("huber", huber, "reduce the weight of array samples with a large Mahalanobis distance");
    visitor.field(
        "huber_probability", huber_probability,
        "array samples beyond this χ² quantile get less weight; 0.95 is the paper's c = 3.55 at 6 degrees of freedom");
    visitor.field(
        "huber_power", huber_power,
        "smoother: the weight is (quantile / distance) to this power; 1 is Huber's weight (the paper), 2 nearly "
        "ignores far outliers such as passing steel");
    visitor.field("map_sigma", map_sigma, "add the map's posterior variance to the sensor's noise");
    visitor.field("map_correlation_m", map_correlation_m,
                  "correlation length of the map's error: closer samples share the error; below 0: the value of the "
                  "map file, or 0.1 m if it has none");
    visitor.field("samples_per_reading", samples_per_reading,
                  "number of consecutive samples averaged into one (smoother)");
    visitor.section("map", map);
  }

  void check() const {
    option_checks::within("beta", beta, 0.0, 1.0);
    option_checks::within("huber_probability", huber_probability, 0.01, 0.999999);
    option_checks::within("huber_power", huber_power, 1.0, 4.0);
    option_checks::within("map_correlation_m", map_correlation_m, -1.0, 1e6);
    option_checks::within("samples_per_reading", samples_per_reading, 1, 1000);
  }
};

/// The refinement after the window has processed the whole log.
enum class Refinement {
  none,  ///< the window's estimates are the result
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
    visitor.field("window_s", window_s, "length of the sliding window, which is the lag of the smoothed output");
    visitor.field("reassociations", reassociations,
                  "repeated associations of a scan in its step, at most; 0: of no scan");
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
    visitor.field("beta", beta, "replaces magnetic.beta for the filter; 0.3 is the paper's");
    visitor.field(
        "map_error_repeats", map_error_repeats,
        "replaces lidar.association.map_error_repeats: the filter treats the errors of all scans as independent");
    visitor.field("deskewing_errors", deskewing_errors,
                  "model errors of velocity, biases and IMU that displace the points of a scan, and estimate them; "
                  "false: as in the paper, deskewing is assumed to be exact");
    visitor.section("degeneracy", degeneracy);
  }

  void check() const {
    option_checks::within("beta", beta, 0.0, 1.0);
    option_checks::not_negative("map_error_repeats", map_error_repeats);
    option_checks::within("lidar_iterations", lidar_iterations, 1, 100);
  }
};

struct WheelOptions {
  bool enabled = true;

  template <class Visitor>
  void visit(Visitor& visitor) {
    visitor.field("enabled", enabled,
                  "use the wheel odometry of the platform file; false: as without its section wheels");
  }
};

/// Options of the checks of a finished run.
struct ReportOptions {
  StaleMapOptions stale_map;

  template <class Visitor>
  void visit(Visitor& visitor) {
    visitor.section("stale_map", stale_map);
  }
};

/// All options of a run. Sections `lidar`, `initial`, `wheels` and most of `magnetic` apply to every estimator that
/// uses these sensors.
struct RunOptions {
  InitialOptions initial;
  LidarOptions lidar;
  DegeneracyOptions degeneracy;
  MagneticOptions magnetic;
  WheelOptions wheels;
  SmootherOptions smoother;
  FilterOptions ieskf;
  ContinuousTimeOptions continuous_time;
  MagneticCalibratingOptions magnetic_calibrating;
  ParticleOptions magnetic_particle;
  StochasticOptions magnetic_stochastic;
  NdtFilterOptions ndt;
  PlaceSearchOptions search;
  ReportOptions report;

  template <class Visitor>
  void visit(Visitor& visitor) {
    visitor.section("initial", initial);
    visitor.section("lidar", lidar);
    visitor.section("degeneracy", degeneracy);
    visitor.section("magnetic", magnetic);
    visitor.section("wheels", wheels);
    visitor.section("smoother", smoother);
    visitor.section("ieskf", ieskf);
    visitor.section("continuous_time", continuous_time);
    visitor.section("magnetic_calibrating", magnetic_calibrating);
    visitor.section("magnetic_particle", magnetic_particle);
    visitor.section("magnetic_stochastic", magnetic_stochastic);
    visitor.section("ndt", ndt);
    visitor.section("search", search);
    visitor.section("report", report);
  }
};

}  // namespace lodestone

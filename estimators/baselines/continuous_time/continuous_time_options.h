#pragma once

#include "core/lidar/scan_sampling.h"
#include "core/option_checks.h"

namespace lodestone {

/// Defaults: those of the authors' program, or derived from them (docs/design/057-continuous-time.md).
struct ContinuousTimeOptions {
  double window_s = 0.01;
  double angular_acceleration_density_rad_s2_sqrt_hz = 0.0316;
  double jerk_density_m_s3_sqrt_hz = 0.0316;
  double point_sigma_m = 0.0316;
  int iterations = 4;
  double min_localizability = 500.0;
  int localizability_windows = 5;
  double angular_velocity_sigma_rad_s = 0.1;
  double acceleration_sigma_m_s2 = 0.1;
  ScanSamplingOptions sampling = fine_sampling();

  static ScanSamplingOptions fine_sampling() {
    ScanSamplingOptions options;
    options.voxel_m = 0.1;
    return options;
  }

  template <class Visitor>
  void visit(Visitor& visitor) {
    visitor.field("window_s", window_s, "a scan is divided into windows of at most this length, each with one update");
    visitor.field("angular_acceleration_density_rad_s2_sqrt_hz", angular_acceleration_density_rad_s2_sqrt_hz,
                  "density of the white noise that is the angular acceleration, each axis");
    visitor.field("jerk_density_m_s3_sqrt_hz", jerk_density_m_s3_sqrt_hz,
                  "density of the white noise that is the jerk, each axis");
    visitor.field("point_sigma_m", point_sigma_m, "sigma of every point-to-plane residual");
    visitor.field("iterations", iterations, "iterations of an update, each with new correspondences");
    visitor.field(
        "min_localizability", min_localizability,
        "points of a window are kept, the best first, until the sum of their contributions reaches this value "
        "in each direction; 0: all points are used");
    visitor.field("localizability_windows", localizability_windows,
                  "number of windows over which contributions are summed");
    visitor.field("angular_velocity_sigma_rad_s", angular_velocity_sigma_rad_s,
                  "sigma of the initial angular velocity, which is assumed to be zero");
    visitor.field("acceleration_sigma_m_s2", acceleration_sigma_m_s2,
                  "sigma of the initial acceleration, which is assumed to be zero");
    visitor.section("sampling", sampling);
  }

  void check() const {
    option_checks::within("window_s", window_s, 0.001, 1.0);
    option_checks::positive("angular_acceleration_density_rad_s2_sqrt_hz", angular_acceleration_density_rad_s2_sqrt_hz);
    option_checks::positive("jerk_density_m_s3_sqrt_hz", jerk_density_m_s3_sqrt_hz);
    option_checks::positive("point_sigma_m", point_sigma_m);
    option_checks::within("iterations", iterations, 1, 100);
    option_checks::not_negative("min_localizability", min_localizability);
    option_checks::within("localizability_windows", localizability_windows, 1, 1000);
    option_checks::positive("angular_velocity_sigma_rad_s", angular_velocity_sigma_rad_s);
    option_checks::positive("acceleration_sigma_m_s2", acceleration_sigma_m_s2);
  }
};

}  // namespace lodestone

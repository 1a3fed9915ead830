#pragma once

#include <vector>

#include "core/imu/scan_motion.h"
#include "core/magnetometer/array_reading.h"
#include "core/magnetometer/field_evidence.h"
#include "estimators/factory.h"

namespace lodestone {

/// The readings of one scan, prepared for many poses.
struct MatchedScan {
  struct Reading {
    Vector3 position = Vector3::Zero();     ///< of the magnetometer at the reading's time, imu frame at t_k
    Vector3 measured_ut = Vector3::Zero();  ///< imu axes at t_k
    double variance_ut2 = 1.0;              ///< per component: noise and calibration of the sensor
  };
  struct Array {
    std::vector<Reading> readings;
    double information_share = 1.0;  ///< exponent of the likelihood, since errors repeat between neighbouring readings
  };
  std::vector<Array> arrays;
};

/// Number of magnetometers that share an error of the map with this correlation length, mean over the array.
double mean_crowding(const SensorSuite& suite, double correlation_m);

/// Compares the readings of an array with the field map at many poses, by a heavy-tailed likelihood: the residual of
/// each magnetometer has a Student distribution in three dimensions, with 4 degrees of freedom (Lange, Little and
/// Taylor 1989). Its scale is the noise of the sensor, the sigmas of its calibration, and the sigma of the map.
class FieldMatching {
 public:
  /// `input` must have a field map, and must outlive this.
  explicit FieldMatching(const EstimatorInput& input);

  /// The readings of a bundle. `end`: the state at the scan's end, from which the motion within the scan is computed.
  MatchedScan match(const ScanBundle& bundle, const NavState& end) const;

  /// ln p(readings | T_map_imu at t_k), without a constant. A reading off the map has the distribution of the whole
  /// map's field, so that poses on and off the map are comparable, times the small probability that the robot is where
  /// the map does not describe the field (kStaleShare).
  double log_likelihood(const MatchedScan& scan, const Pose& T_map_imu) const;

  /// Statistics of the readings at the estimated pose. The weight of an array is the mean weight of its magnetometers
  /// under the Student distribution, at most 1 each.
  void report(const MatchedScan& scan, const Pose& T_map_imu, Diagnostics& diagnostics) const;

  /// Whether the map observes heights.
  bool observes_height() const { return input_.field->grid().heights_m.size() > 1; }

 private:
  struct Residual {
    double squared_ut2 = 0.0;
    double variance_ut2 = 1.0;      ///< per component
    double map_variance_ut2 = 0.0;  ///< part of it
    double log_prior = 0.0;         ///< that the map describes the field here
    bool on_map = false;
  };
  Residual residual(const MatchedScan::Reading& reading, const Pose& T_map_imu) const;
  void set_information_share(const NavState& end, double spacing_m, MatchedScan::Array& array) const;

  const EstimatorInput& input_;
  FieldBackground background_;
  double correlation_m_;
  double crowding_;  ///< number of magnetometers that share a map error, mean over the array
};

}  // namespace lodestone

#pragma once

#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "core/magnetometer/field_evidence.h"
#include "estimators/factory.h"
#include "estimators/smoother/keyframe.h"

namespace lodestone {

/// A direction of the search: the pose moves by `axis` (φ right, p map) in `steps` steps to either side.
struct SearchDirection {
  Vector6 axis = Vector6::Zero();  ///< one step
  int steps = 0;
};

/// Searches a grid of poses for the best fit of a keyframe's scan and field readings. Used where the error exceeds the
/// reach of a linearization: an initial pose that is off by more than a wall's thickness, or seconds with an
/// unobservable direction.
class PoseSearch {
 public:
  /// `state`: of the keyframe, to deskew its scan. `bias_ut`: of each magnetometer.
  PoseSearch(const EstimatorInput& input, const Keyframe& keyframe, const NavState& state,
             const std::function<Vector3(int)>& bias_ut);

  /// The pose in the grid around `about` that fits clearly better than `about`; of several equally good poses the
  /// nearest. Empty if there is none, or if scan and readings do not outweigh the prior `about` with `covariance` (φ
  /// right, p map). `background`: of the whole field map, called only if a pose is found.
  std::optional<Pose> find(const Pose& about, const std::vector<SearchDirection>& directions, const Matrix6& covariance,
                           const std::function<FieldBackground()>& background) const;

  /// Quality of the fit: the share of points on their planes plus the share of readings that agree with the map, each
  /// from 0 to 1. Both decrease smoothly over `slack` (1: coarse).
  double fit(const Pose& T_map_imu, double slack) const;

  /// The same with a quarter of the points.
  double rough_fit(const Pose& T_map_imu, double slack) const;

  /// ln p(scan, readings | pose) up to a constant, as in the search of the whole map: a scan counts as at most
  /// kIndependentPoints points, and an array's readings share the errors of the map.
  double log_likelihood(const Pose& T_map_imu, const FieldBackground& background) const;

  /// The same data at a place off the map.
  double log_likelihood_off_map(const Quaternion& attitude, const FieldBackground& background) const;

  /// The pose at which the scan is registered, from `start` (register_scan).
  Pose registered(const Pose& start) const;

  bool has_readings() const { return !newest_array_.readings.empty(); }

 private:
  double fit_of(std::span<const Eigen::Vector3f> points, const Pose& T_map_imu, double slack) const;
  std::optional<Pose> best_fit(const Pose& about, const std::vector<SearchDirection>& directions) const;

  const EstimatorInput& input_;
  std::vector<Eigen::Vector3f> points_;  // imu frame at the scan's end
  std::vector<Eigen::Vector3f> few_points_;
  std::optional<ScanLidars> lidars_;  // of the points
  std::shared_ptr<const PlaneMap> planes_;
  struct Reading {
    Pose T_end_mag;
    Vector3 measured_ut;
    double sigma_ut;
  };
  std::vector<Reading> readings_;
  ArrayReading newest_array_;  // biases subtracted
  std::shared_ptr<const MagneticMap> field_;
};

}  // namespace lodestone

#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "estimators/factory.h"
#include "estimators/initialization/field_evidence.h"
#include "estimators/smoother/keyframe.h"

namespace lodestone {

/// A direction to look along: the pose moves by `axis` (φ right, p map) in `steps` steps to either side.
struct SearchDirection {
  Vector6 axis = Vector6::Zero();  ///< one step
  int steps = 0;
};

/// Looks on a grid of poses for the one that a keyframe's scan and readings of the field fit best: for where a
/// linearization reaches too short, at a start that is off by more than a wall's thickness or after seconds without a
/// sight of one direction.
class PoseSearch {
 public:
  /// `state`: the keyframe's, which its scan is deskewed with. `bias_ut`: of each magnetometer.
  PoseSearch(const EstimatorInput& input, const Keyframe& keyframe, const NavState& state,
             const std::function<Vector3(int)>& bias_ut);

  /// The pose within the grid about `about` that fits clearly better than `about` itself; of several that fit as well
  /// the nearest. Nothing where there is none, or where scan and readings do not outweigh what was known before: that
  /// the pose is `about`, with `covariance` (φ right, p map). `background`: of the whole field map, asked for only
  /// where a pose was found.
  std::optional<Pose> find(const Pose& about, const std::vector<SearchDirection>& directions, const Matrix6& covariance,
                           const std::function<FieldBackground()>& background) const;

  /// How well the pose fits: the share of points that lie on their planes plus the share of readings that are those of
  /// the map, each from 0 to 1, both falling off smoothly over `slack` (1: coarse).
  double fit(const Pose& T_map_imu, double slack) const;

  /// ln p(scan, readings | pose) but for a constant, by the rules of the search of the whole map: a scan says no more
  /// than kIndependentPoints do, and an array no more than one whose errors the map shares.
  double log_likelihood(const Pose& T_map_imu, const FieldBackground& background) const;

 private:
  std::optional<Pose> best_fit(const Pose& about, const std::vector<SearchDirection>& directions) const;

  const EstimatorInput& input_;
  std::vector<Eigen::Vector3f> points_;  // imu frame at the scan's end
  std::shared_ptr<const PlaneMap> planes_;
  struct Reading {
    Pose T_end_mag;
    Vector3 measured_ut;
    double sigma_ut;
  };
  std::vector<Reading> readings_;
  ArrayReading newest_array_;  // without the biases
  std::shared_ptr<const MagneticMap> field_;
};

}  // namespace lodestone

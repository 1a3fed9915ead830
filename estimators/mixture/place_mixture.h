#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "core/imu/preintegration.h"
#include "core/magnetometer/array_reading.h"
#include "estimators/factory.h"
#include "estimators/initialization/field_evidence.h"

namespace lodestone {

/// One Gaussian of a mixture. The covariance (17 + 3 J square, J magnetometers) has the order of namespace tangent,
/// then the offsets.
struct PlaceComponent {
  NavState state;
  Eigen::VectorXd offsets_ut;  ///< constant error of each magnetometer in its own axes, J times x, y, z
  Eigen::MatrixXd covariance;
  double log_weight = 0.0;
  std::size_t parent = 0;  ///< index of the component before this scan that it comes from

  /// Adds a step, in the order of the covariance, to state and offsets.
  void move(const Eigen::VectorXd& delta);
};

/// The δ with which `from.move(δ)` has the state and offsets of `to`.
Eigen::VectorXd step_between(const PlaceComponent& from, const PlaceComponent& to);

/// One component with the weight, mean and covariance of all; its parent is that of the first.
PlaceComponent merged_place(std::span<const PlaceComponent* const> members);

/// A component at the next scan's end, by the IMU alone.
struct PlacePrediction {
  PlaceComponent component;
  Eigen::MatrixXd crossed;  ///< F P: covariance of the predicted with the present error
};
PlacePrediction predicted_place(const PlaceComponent& component, const Preintegration& increment,
                                const ImuNoise& noise);

/// Where a robot may be on a field map, as a mixture of Gaussians: the Gaussian sum filter (Sorenson and Alspach 1971).
/// Each component is an extended Kalman filter with IMU and magnetometers. A component that is wider than the field map
/// is linear is split (Huber 2011), so that a mixture follows all places that fit the readings; components that meet
/// are merged. docs/design/060
class PlaceMixture {
 public:
  /// `input` must have a field map and magnetometers, and must outlive this. Starts at its initial pose.
  explicit PlaceMixture(const EstimatorInput& input);

  /// One scan: prediction, height of the map's layer, wheels, readings.
  void process(const ScanBundle& bundle);

  /// After the newest scan, the heaviest first. The weights' sum is 1.
  const std::vector<PlaceComponent>& components() const { return components_; }

  /// As Diagnostics::wheel_weight, of the newest scan.
  double wheel_weight() const { return wheel_weight_; }

  /// The IMU of the newest scan; none if there was none.
  const std::optional<Preintegration>& increment() const { return increment_; }

 private:
  void predict(std::span<const ImuSample> imu);
  void split();
  void update_height(PlaceComponent& component) const;
  void update_wheels(const ScanBundle& bundle);
  void update(const ArrayReading& array, double spacing_m);
  double information_share(const ArrayReading& array, double spacing_m) const;
  void reduce();

  const EstimatorInput& input_;
  FieldBackground background_;
  double correlation_m_;
  double crowding_;  ///< number of magnetometers that share a map error, mean over the array
  std::vector<PlaceComponent> components_;
  std::optional<Preintegration> increment_;
  double wheel_weight_ = -1.0;
};

/// The change of a component's error state by a scan: F, and the covariance that the IMU adds, 17×17 each. `increment`:
/// of the scan; `before`: the state at its begin.
struct PlaceTransition {
  Matrix17 by_state;
  Matrix17 noise;
};
PlaceTransition place_transition(const Preintegration& increment, const NavState& before, const ImuNoise& noise);

}  // namespace lodestone

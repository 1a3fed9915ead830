#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "core/imu/preintegration.h"

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

/// Moves a component to the next scan's end, by the IMU alone. `crossed` becomes F P, the covariance of the predicted
/// with the present error.
void predict_place(const Preintegration& increment, const ImuNoise& noise, PlaceComponent& component,
                   Eigen::MatrixXd& crossed);

/// The change of a component's error state by a scan: F, and the covariance that the IMU adds, 17×17 each.
/// `increment`: of the scan; `before`: the state at its begin.
struct PlaceTransition {
  Matrix17 by_state;
  Matrix17 noise;
};
PlaceTransition place_transition(const Preintegration& increment, const NavState& before, const ImuNoise& noise);

}  // namespace lodestone

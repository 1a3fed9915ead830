#pragma once

#include "core/geometry/pose.h"

namespace lodestone {

/// A motion of the trajectory that no sensor observes: along a straight tunnel, or along a bend, rotating with the
/// bend. A metre of the slide moves a pose at `at` by `direction`, and rotates all poses by `turn` about that place. A
/// finite slide is a rigid motion of the map. Its tangent is 1.2 mm off after a metre in a bend of 400 m radius, more
/// than the 0.1 mm that scans know; linear coordinates of poses would thus resist the slide (docs/design/010).
struct Slide {
  Vector3 at = Vector3::Zero();         ///< m, map
  Vector3 direction = Vector3::Zero();  ///< unit, map axes; zero: no slide
  Vector3 turn = Vector3::Zero();       ///< rad/m, map axes

  bool any() const { return !direction.isZero(0.0); }

  /// The slide along a degenerate direction (tangent φ, p) of a pose; empty if it rotates the pose by more than 0.3 rad
  /// a metre.
  static Slide along(const Vector6& degenerate, const Pose& pose);

  /// The same motion of the map, relative to another place.
  Slide about(const Vector3& place) const;

  /// For checkpoints.
  template <class Archive>
  void serialize(Archive& archive) {
    archive(at, direction, turn);
  }
};

/// A pose moved back along a slide until it is level with the slide's place.
struct Unslid {
  double distance_m = 0.0;  ///< distance moved back along the slide
  Pose pose;
  Quaternion back = Quaternion::Identity();  ///< rotates vectors that slid along (a velocity) back as well
  Vector3 by_position = Vector3::Zero();     ///< ∂distance / ∂p of the pose, a row
  Vector3 flow = Vector3::Zero();            ///< −∂p of `pose` / ∂distance
};

Unslid unslide(const Slide& slide, const Pose& pose);

/// A pose moved by an error of the map at its place (φ in map axes, p).
Pose moved_by(const Vector6& error, const Pose& pose);

/// Derivative of the moved pose's right tangent (φ; p in map axes) with respect to the error.
Matrix6 moved_by_jacobian(const Vector6& error, const Pose& moved);

/// x ⊟ x₀ with its slide straightened: the difference after x is moved back, plus the slide in the tangent of x₀. To
/// first order x ⊟ x₀; along the slide the value changes in one direction only, exactly, for any distance. `slide`:
/// about x₀. `error` (φ in map axes, p) moves the pose after it is moved back: an error that slid along would rotate
/// with the bend and give information about the slide (docs/design/010).
struct SlideDifference {
  Unslid unslid;
  Vector6 value;       ///< φ, p
  Matrix6 by_tangent;  ///< by the right tangent of x
  Matrix6 by_error;
};

SlideDifference difference_along(const Slide& slide, const Pose& x, const Pose& x0,
                                 const Vector6& error = Vector6::Zero());

}  // namespace lodestone

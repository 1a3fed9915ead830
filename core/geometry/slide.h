#pragma once

#include "core/geometry/pose.h"

namespace lodestone {

/// How a trajectory may slide where no sensor holds it: along a straight tunnel, or along a bend, turning with it. A
/// metre of it shifts a pose at `at` by `direction` and turns it, and all else that slides along, by `turn` about that
/// place. A finite slide is a rigid motion of the map, whose tangent leaves a bend of 400 m by 1.2 mm after a metre:
/// linear coordinates of poses would hold it back where scans know 0.1 mm.
struct Slide {
  Vector3 at = Vector3::Zero();         ///< m, map
  Vector3 direction = Vector3::Zero();  ///< unit, map axes; zero: nothing slides
  Vector3 turn = Vector3::Zero();       ///< rad/m, map axes

  bool any() const { return !direction.isZero(0.0); }

  /// Of a direction `hidden` (tangent φ, p) of a pose; none where it turns the pose more than 0.3 rad a metre.
  static Slide along(const Vector6& hidden, const Pose& pose);

  /// The same motion of the map, about another place.
  Slide about(const Vector3& place) const;

  /// For checkpoints.
  template <class Archive>
  void serialize(Archive& archive) {
    archive(at, direction, turn);
  }
};

/// A pose taken back along a slide until it is level with the slide's place.
struct Unslid {
  double distance_m = 0.0;  ///< how far it had slid
  Pose pose;
  Quaternion back = Quaternion::Identity();  ///< turns what slid along (a velocity) back as well
  Vector3 by_position = Vector3::Zero();     ///< ∂distance / ∂p of the pose, a row
  Vector3 flow = Vector3::Zero();            ///< −∂p of `pose` / ∂distance
};

Unslid unslide(const Slide& slide, const Pose& pose);

/// A pose moved by an error of the map at its place (φ in map axes, p).
Pose moved_by(const Vector6& error, const Pose& pose);

/// Derivative of the moved pose's right tangent (φ; p in map axes) by the error.
Matrix6 moved_by_jacobian(const Vector6& error, const Pose& moved);

/// x ⊟ x₀ with the slide in it straightened: what the pose is off once it is taken back, plus the slide as x₀'s tangent
/// has it. To first order x ⊟ x₀; along the slide it changes in one direction, exactly and however far. `slide`: about
/// x₀. `error` (φ in map axes, p) moves the pose once it is taken back: an error that slid along would turn with the
/// bend, and tell of the slide.
struct SlideDifference {
  Unslid unslid;
  Vector6 value;       ///< φ, p
  Matrix6 by_tangent;  ///< by the right tangent of x
  Matrix6 by_error;
};

SlideDifference difference_along(const Slide& slide, const Pose& x, const Pose& x0,
                                 const Vector6& error = Vector6::Zero());

}  // namespace lodestone

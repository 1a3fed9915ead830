#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "core/geometry/pose.h"

namespace lodestone::simulation {

/// A smooth random vector field: each component is an independent draw from a zero-mean Gaussian process with the
/// kernel rms² exp(−r² / (2 length²)), approximated by random Fourier features (Rahimi and Recht 2007). Immutable.
///
/// A map that is displaced by this field shows the object at x at the position x + d(x).
class DisplacementField {
 public:
  /// One feature: amplitude_cos cos(wave · x) + amplitude_sin sin(wave · x).
  struct Wave {
    Vector3 wave = Vector3::Zero();           ///< rad/m
    Vector3 amplitude_cos = Vector3::Zero();  ///< m
    Vector3 amplitude_sin = Vector3::Zero();  ///< m
  };

  /// No displacement.
  DisplacementField() = default;

  /// `rms_m`: standard deviation of a component; 0: no features. `purpose` names the random stream.
  DisplacementField(double rms_m, double length_m, std::uint64_t seed, std::string_view purpose);

  bool empty() const { return waves_.empty(); }

  /// d(x), metres, map axes.
  Vector3 at(const Vector3& point) const;

  /// ∂d/∂x.
  Matrix3 gradient(const Vector3& point) const;

  /// `pose` (map) in the displaced map: the position moves by d, and the axes turn by the map's local rotation Exp(½
  /// curl d), from the antisymmetric part of the gradient.
  Pose displaced(const Pose& pose) const;

  const std::vector<Wave>& waves() const { return waves_; }

 private:
  std::vector<Wave> waves_;
};

}  // namespace lodestone::simulation

#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "core/geometry/pose.h"

namespace lodestone::simulation {

/// A smooth random vector field: each component is an independent draw from a Gaussian process of zero mean with the
/// kernel rms² exp(−r² / (2 length²)), as a sum of random Fourier features. Source: Rahimi and Recht 2007. Immutable.
///
/// A map that is bent by this field shows at x + d(x) what stands at x.
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

  /// `rms_m` is the standard deviation of a component. `purpose` names the random stream. No features if it is 0.
  DisplacementField(double rms_m, double length_m, std::uint64_t seed, std::string_view purpose);

  bool empty() const { return waves_.empty(); }

  /// d(x), metres, map axes.
  Vector3 at(const Vector3& point) const;

  /// ∂d/∂x.
  Matrix3 gradient(const Vector3& point) const;

  /// Where something at `pose` (map) is in the bent map: the position moves by d, and the axes turn by the local
  /// rotation of the map, Exp(½ curl d), which is the antisymmetric part of the gradient.
  Pose displaced(const Pose& pose) const;

  const std::vector<Wave>& waves() const { return waves_; }

 private:
  std::vector<Wave> waves_;
};

}  // namespace lodestone::simulation

#pragma once

#include <cstdint>
#include <vector>

#include "frontends/simulation/scene.h"

namespace lodestone::simulation {

/// Field of one source at `point` (map), µT.
///   dipole: B = μ0/4π (3 (m·r̂) r̂ − m) / r³;   bar: B = μ0/4π q (r₁/r₁³ − r₂/r₂³), q = m / length.
Vector3 source_field_ut(const FieldSource& source, const Vector3& point);

/// The ambient field of a world: the earth's and that of every piece of steel.
///
/// A source fades out smoothly (twice differentiable, so that no step or kink shows in the field or its gradient)
/// where its own field has fallen to about 5e-4 µT; nearer it is exact. Immutable; queries are thread-safe.
class MagneticField {
 public:
  MagneticField(const Vector3& earth_field_ut, std::vector<FieldSource> sources);

  /// µT, map axes. A source is never singular: nearer than 1 cm to a pole the field stays finite.
  Vector3 field_ut(const Vector3& point) const;

  /// The same by summing every source, without the fading and the cells: the oracle of the tests.
  Vector3 field_of_all_ut(const Vector3& point) const;

 private:
  struct Reach {
    Vector3 center;
    double start = 0.0;  ///< the fading starts here, m
    double end = 0.0;    ///< and ends here
  };
  Vector3 earth_;
  std::vector<FieldSource> sources_;
  std::vector<Reach> reaches_;
  Eigen::Vector2d origin_ = Eigen::Vector2d::Zero();
  int columns_ = 0;
  int rows_ = 0;
  std::vector<std::uint32_t> cell_begin_;  ///< columns * rows + 1 offsets into cell_sources_
  std::vector<std::uint32_t> cell_sources_;
};

}  // namespace lodestone::simulation

#pragma once

#include <memory>
#include <vector>

#include "tools/simulate/scene.h"

namespace lodestone::simulation {

/// Field of one source at `point` (map), µT. Finite even within a centimetre of a pole.
///   dipole: B = μ0/4π (3 (m·r̂) r̂ − m) / r³;   bar: B = μ0/4π q (r₁/r₁³ − r₂/r₂³), q = m / length.
Vector3 source_field_ut(const FieldSource& source, const Vector3& point);

/// The ambient field of a world: the earth's field plus the field of all steel.
///
/// Steel within a few metres is summed exactly. The field of farther steel is smooth: it is summed at Chebyshev nodes
/// of a spatial cell when the cell is first entered, then interpolated, to about 1e-4 µT. Queries are thread-safe, and
/// the result does not depend on their order.
class MagneticField {
 public:
  MagneticField(const Vector3& earth_field_ut, std::vector<FieldSource> sources);
  ~MagneticField();
  MagneticField(const MagneticField&) = delete;
  MagneticField& operator=(const MagneticField&) = delete;

  /// µT, map axes.
  Vector3 field_ut(const Vector3& point) const;

  /// The same by summing every source: the reference of the tests.
  Vector3 field_of_all_ut(const Vector3& point) const;

 private:
  struct Cell;
  struct Cells;
  std::shared_ptr<const Cell> make_cell(const Eigen::Vector3i& index) const;

  Vector3 earth_;
  std::vector<FieldSource> sources_;
  std::unique_ptr<Cells> cells_;
};

}  // namespace lodestone::simulation

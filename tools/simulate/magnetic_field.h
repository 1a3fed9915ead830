#pragma once

#include <memory>
#include <vector>

#include "tools/simulate/scene.h"

namespace lodestone::simulation {

/// Field of one source at `point` (map), µT. Within a centimetre of a pole it stays finite.
///   dipole: B = μ0/4π (3 (m·r̂) r̂ − m) / r³;   bar: B = μ0/4π q (r₁/r₁³ − r₂/r₂³), q = m / length.
Vector3 source_field_ut(const FieldSource& source, const Vector3& point);

/// The ambient field of a world: the earth's and that of every piece of steel, none left out.
///
/// Steel within a few metres is summed exactly. What lies farther is smooth: it is summed at Chebyshev nodes of cells
/// of space when a cell is first entered, and interpolated from there, to about 1e-4 µT. The result does not depend on
/// who asks first: queries are thread-safe and deterministic.
class MagneticField {
 public:
  MagneticField(const Vector3& earth_field_ut, std::vector<FieldSource> sources);
  ~MagneticField();
  MagneticField(const MagneticField&) = delete;
  MagneticField& operator=(const MagneticField&) = delete;

  /// µT, map axes.
  Vector3 field_ut(const Vector3& point) const;

  /// The same by summing every source: the oracle of the tests.
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

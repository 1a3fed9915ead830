#pragma once

#include <cstdint>
#include <vector>

#include "tools/simulate/motion.h"
#include "tools/simulate/ray_caster.h"

namespace lodestone::simulation {

/// A person (an upright cylinder) or a vehicle (a box with steel) that moves to and fro on a straight line on the
/// floor.
struct Mover {
  bool is_vehicle = false;
  Eigen::Vector2d from = Eigen::Vector2d::Zero();  ///< ends of the line, map, m
  Eigen::Vector2d to = Eigen::Vector2d::Zero();
  double speed_m_s = 1.0;
  double meeting_s = 0.0;  ///< time at which the mover is `meeting_m` along the line, on its way to `to`
  double meeting_m = 0.0;
  double begin_s = 0.0;            ///< present from this time
  double end_s = 0.0;              ///< present until this time
  std::vector<FieldSource> steel;  ///< in its own axes: x along the line, z up from the floor

  Eigen::Vector2d place(double seconds) const;
};

/// People and vehicles that the robot meets on a drive. Immutable; thread-safe.
class Movers {
 public:
  /// No movers.
  Movers() = default;

  /// Draws encounters along the drive, with `people` and `vehicles` present at any time on average. A mover's line is
  /// free of obstacles, and the mover never touches the robot. Narrow places have fewer movers. Deterministic by
  /// `seed`.
  Movers(double people, double vehicles, const RayCaster& caster, const Motion& motion, std::uint64_t seed);

  const std::vector<Mover>& list() const { return movers_; }

  /// Movers that are present at some time in [begin_s, end_s], within `reach_m` of `place` (map).
  std::vector<const Mover*> near(double begin_s, double end_s, const Vector3& place, double reach_m) const;

  /// Field of the steel of all vehicles at `point` (map), µT.
  Vector3 field_ut(double seconds, const Vector3& point) const;

 private:
  std::vector<Mover> movers_;
};

/// Intersection of a unit ray with a mover at `seconds`; the range is negative if there is none.
RayHit meet(const Mover& mover, double seconds, const Vector3& origin, const Vector3& direction);

}  // namespace lodestone::simulation

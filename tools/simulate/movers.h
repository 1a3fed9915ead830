#pragma once

#include <cstdint>
#include <vector>

#include "tools/simulate/motion.h"
#include "tools/simulate/ray_caster.h"

namespace lodestone::simulation {

/// A person (an upright cylinder) or a vehicle (a box with steel) that goes to and fro on a straight line on the floor.
struct Mover {
  bool is_vehicle = false;
  Eigen::Vector2d from = Eigen::Vector2d::Zero();  ///< ends of the line, map, m
  Eigen::Vector2d to = Eigen::Vector2d::Zero();
  double speed_m_s = 1.0;
  double meeting_s = 0.0;  ///< moment of the drive at which it is `meeting_m` along the line, on its way to `to`
  double meeting_m = 0.0;
  double begin_s = 0.0;            ///< it is there from then
  double end_s = 0.0;              ///< until then
  std::vector<FieldSource> steel;  ///< in its own axes: x along the line, z up from the floor

  Eigen::Vector2d place(double seconds) const;
};

/// The people and vehicles that a robot meets on a drive. Immutable; thread-safe.
class Movers {
 public:
  /// Nobody.
  Movers() = default;

  /// Draws encounters along the drive: `people` and `vehicles` of them at any moment on average. Each goes where
  /// nothing stands, and keeps off the robot. In narrow places there are fewer. Deterministic by `seed`.
  Movers(double people, double vehicles, const RayCaster& caster, const Motion& motion, std::uint64_t seed);

  const std::vector<Mover>& list() const { return movers_; }

  /// Those who are there at some moment of [begin_s, end_s], within `reach_m` of `place` (map).
  std::vector<const Mover*> near(double begin_s, double end_s, const Vector3& place, double reach_m) const;

  /// Field of the steel of all vehicles at `point` (map), µT.
  Vector3 field_ut(double seconds, const Vector3& point) const;

 private:
  std::vector<Mover> movers_;
};

/// Where a unit ray meets a mover at `seconds`; a negative range if it does not.
RayHit meet(const Mover& mover, double seconds, const Vector3& origin, const Vector3& direction);

}  // namespace lodestone::simulation

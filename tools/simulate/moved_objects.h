#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tools/simulate/scene.h"

namespace lodestone::simulation {

enum class ObjectChange {
  shifted,  ///< mapped at one place, elsewhere on the drive
  gone,     ///< mapped, and absent on the drive
  added     ///< on the drive, and not mapped
};

constexpr auto enum_names(ObjectChange) {
  return EnumNames<ObjectChange, 3>{
      {{ObjectChange::shifted, "shifted"}, {ObjectChange::gone, "gone"}, {ObjectChange::added, "added"}}};
}

struct MovedObject {
  ObjectChange change = ObjectChange::shifted;
  std::string name;                     ///< of its solid; may be empty
  Vector3 size = Vector3::Zero();       ///< along the map's axes, m
  Vector3 mapped_at = Vector3::Zero();  ///< centre, map, m; undefined if added
  Vector3 driven_at = Vector3::Zero();  ///< centre, map, m; undefined if gone
};

/// Objects that were moved, removed or added between the survey of both maps and the drive.
struct MovedObjects {
  Rearrangement mapped;  ///< the world that was surveyed
  Rearrangement driven;  ///< the world that is driven through
  std::vector<MovedObject> list;
};

/// Draws a share of the world's movable objects: boxes, cylinders and groups of them, at most 3 m long and wide and 2.2
/// m high, that belong to no wall, floor or tube. A third each is shifted by 0.3 to 2 m, removed, or added since the
/// survey. Further boxes are added on the floor beside the paths, so that worlds without movable objects change too.
/// Shifted and added objects keep 1 m from the paths of all sequences. The draw depends on the world and `seed` alone:
/// maps and logs of one seed agree, for any sequence or scene. A share of 0 moves nothing.
MovedObjects draw_moved_objects(const World& world, std::uint64_t seed);

}  // namespace lodestone::simulation

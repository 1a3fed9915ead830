#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "core/geometry/so3.h"
#include "tools/simulate/world.h"

namespace lodestone::simulation {

/// How a surface responds to a beam.
struct Surface {
  double transparency = 0.0;        ///< share of beams that pass; the rest is returned, or reflected away
  double max_incidence_deg = 90.0;  ///< largest angle between a returned beam and the normal

  bool operator==(const Surface&) const = default;
};

struct TriangleMesh {
  std::vector<Eigen::Vector3f> vertices;  ///< map, metres
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<Surface> surfaces{Surface{}};          ///< all distinct surfaces; the first is plain
  std::vector<std::uint16_t> surface_of_triangle{};  ///< index of surfaces; triangles beyond its end have the first

  const Surface& surface_of(std::size_t triangle) const {
    return surfaces[triangle < surface_of_triangle.size() ? surface_of_triangle[triangle] : 0];
  }
};

/// A piece of magnetized steel: a dipole, or a bar (two opposite poles at its ends: a thin rod, magnetized along its
/// axis).
struct FieldSource {
  bool is_bar = false;
  Vector3 position = Vector3::Zero();  ///< the dipole; the bar's north pole (map, m)
  Vector3 south = Vector3::Zero();     ///< the bar's other end (map, m)
  Vector3 moment = Vector3::Zero();    ///< of the dipole, A·m²
  double pole = 0.0;                   ///< of the bar, A·m (its moment over its length)
};

/// All surfaces and all steel of a world, in the map frame.
struct Scene {
  TriangleMesh mesh;
  std::vector<FieldSource> sources;
};

/// One repetition of one of the world's solids, or of a part of a group. Instances are numbered in placement order: a
/// group precedes its parts.
struct SolidInstance {
  const Solid* solid = nullptr;  ///< of the world, which must outlive this
  std::string name;              ///< of the solid, or of the nearest group around it that has one
  std::size_t end = 0;           ///< the number after the last part of this instance
  Eigen::AlignedBox3d bounds;    ///< of its surfaces and those of its parts, map, m; empty without surfaces
};

/// Differences to the world's file, by the numbers of SolidInstance.
struct Rearrangement {
  std::map<std::size_t, Pose> moved;  ///< by instance: transform from the old to the new place (map)
  std::set<std::size_t> gone;         ///< with all their parts
  std::vector<Solid> added;           ///< with their placement in the map

  bool empty() const { return moved.empty() && gone.empty() && added.empty(); }
};

/// The instances of the world's permanent solids.
std::vector<SolidInstance> list_instances(const World& world);

/// The world's permanent solids, then those of the scene `scene` (empty: none). Depends on the world alone (its
/// steel_seed), not on the seed of a run. The sources of permanent solids are the same bits with every scene. A solid
/// of a scene is magnetized by its name: the same car is the same on another day and changes no other steel. (Solids
/// without a name: by scene and place in the list.) Moved solids keep their magnetization, and change no other steel.
/// Throws InputError for an unknown scene.
Scene build_scene(const World& world, const std::string& scene = {}, const Rearrangement& rearrangement = {});

/// Appends the triangles of one solid (its own shape, without parts) at `pose`, with its surface.
void append_shape(const Solid& solid, const Pose& pose, TriangleMesh& mesh);

}  // namespace lodestone::simulation

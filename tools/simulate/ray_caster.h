#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "tools/simulate/scene.h"

namespace lodestone::simulation {

/// Result of one ray.
struct RayHit {
  float range = -1.0F;  ///< metres along the ray; negative: no surface was hit
  float cosine = 0.0F;  ///< |cos| of the angle between ray and surface normal
  std::uint16_t surface = 0;
};

/// Rays against the triangles of a world (Embree). Immutable; queries are thread-safe.
class RayCaster {
 public:
  explicit RayCaster(const TriangleMesh& mesh);
  ~RayCaster();
  RayCaster(const RayCaster&) = delete;
  RayCaster& operator=(const RayCaster&) = delete;

  /// First surface along each of the unit `directions` from one `origin` (map), up to `max_range`.
  void cast(const Eigen::Vector3f& origin, std::span<const Eigen::Vector3f> directions, float max_range,
            std::span<RayHit> hits) const;

  /// The next surface along one ray beyond `range` metres.
  RayHit cast_beyond(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction, float range,
                     float max_range) const;

  /// Whether the line between two points (map) is free, also of glass. The last 2 cm before `to` are ignored.
  bool sees(const Eigen::Vector3f& from, const Eigen::Vector3f& to) const;

  /// Share of beams that pass from one point to another (map): 0 behind an opaque surface, else the product of the
  /// panes' transparencies. The last 2 cm before `to` are ignored.
  double transmission(const Eigen::Vector3f& from, const Eigen::Vector3f& to) const;

  const Surface& surface(const RayHit& hit) const;

  /// Whether any surface is transparent or reflects like a mirror.
  bool has_glass() const;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace lodestone::simulation

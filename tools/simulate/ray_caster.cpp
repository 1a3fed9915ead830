#include "tools/simulate/ray_caster.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>

#include "core/thread_limit.h"

namespace lodestone::simulation {

namespace {

constexpr float end_margin = 0.02F;  // metres before the target point: excludes the surface of the target itself

}  // namespace

struct RayCaster::Implementation {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  std::vector<Surface> surfaces;
  std::vector<std::uint16_t> surface_of_triangle;

  ~Implementation() {
    if (scene != nullptr) rtcReleaseScene(scene);
    if (device != nullptr) rtcReleaseDevice(device);
  }
};

RayCaster::RayCaster(const TriangleMesh& mesh) : implementation_(std::make_unique<Implementation>()) {
  implementation_->surfaces = mesh.surfaces;
  implementation_->surface_of_triangle = mesh.surface_of_triangle;
  implementation_->surface_of_triangle.resize(mesh.triangles.size());
  // Not "threads=1": Embree would then limit all loops of the process to one thread, as long as the device exists.
  implementation_->device = rtcNewDevice(nullptr);
  if (implementation_->device == nullptr) throw std::runtime_error("Embree could not create a device for ray casting");
  implementation_->scene = rtcNewScene(implementation_->device);
  rtcSetSceneFlags(implementation_->scene, RTC_SCENE_FLAG_ROBUST);
  RTCGeometry geometry = rtcNewGeometry(implementation_->device, RTC_GEOMETRY_TYPE_TRIANGLE);
  void* vertices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float),
                                           std::max<std::size_t>(1, mesh.vertices.size()));
  void* triangles = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                            3 * sizeof(std::uint32_t), mesh.triangles.size());
  if (!mesh.triangles.empty()) {
    std::memcpy(vertices, mesh.vertices.data(), mesh.vertices.size() * 3 * sizeof(float));
    std::memcpy(triangles, mesh.triangles.data(), mesh.triangles.size() * 3 * sizeof(std::uint32_t));
  }
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(implementation_->scene, geometry);
  rtcReleaseGeometry(geometry);
  const ThreadLimit one(1);  // the same hierarchy on each machine
  rtcCommitScene(implementation_->scene);
}

RayCaster::~RayCaster() = default;

void RayCaster::cast(const Eigen::Vector3f& origin, std::span<const Eigen::Vector3f> directions, float max_range,
                     std::span<RayHit> hits) const {
  constexpr std::size_t packet = 16;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  for (std::size_t begin = 0; begin < directions.size(); begin += packet) {
    const std::size_t count = std::min(packet, directions.size() - begin);
    alignas(64) int valid[packet];
    alignas(64) RTCRayHit16 rays;
    for (std::size_t i = 0; i < packet; ++i) {
      const Eigen::Vector3f& direction = directions[begin + std::min(i, count - 1)];
      valid[i] = i < count ? -1 : 0;
      rays.ray.org_x[i] = origin.x(), rays.ray.org_y[i] = origin.y(), rays.ray.org_z[i] = origin.z();
      rays.ray.dir_x[i] = direction.x(), rays.ray.dir_y[i] = direction.y(), rays.ray.dir_z[i] = direction.z();
      rays.ray.tnear[i] = 0.0F, rays.ray.tfar[i] = max_range, rays.ray.time[i] = 0.0F;
      rays.ray.mask[i] = ~0U, rays.ray.id[i] = 0, rays.ray.flags[i] = 0;
      rays.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID, rays.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
    }
    rtcIntersect16(valid, implementation_->scene, &context, &rays);
    for (std::size_t i = 0; i < count; ++i) {
      RayHit& hit = hits[begin + i];
      hit = {};
      if (rays.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID) continue;
      const Eigen::Vector3f normal(rays.hit.Ng_x[i], rays.hit.Ng_y[i], rays.hit.Ng_z[i]);
      hit.range = rays.ray.tfar[i];
      hit.cosine = std::abs(normal.normalized().dot(directions[begin + i]));
      hit.surface = implementation_->surface_of_triangle[rays.hit.primID[i]];
    }
  }
}

RayHit RayCaster::cast_beyond(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction, float range,
                              float max_range) const {
  constexpr float step = 1e-3F;  // beyond the last surface, despite rounding of its range
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRayHit query{};
  query.ray.org_x = origin.x(), query.ray.org_y = origin.y(), query.ray.org_z = origin.z();
  query.ray.dir_x = direction.x(), query.ray.dir_y = direction.y(), query.ray.dir_z = direction.z();
  query.ray.tnear = range + step, query.ray.tfar = max_range, query.ray.mask = ~0U;
  query.hit.geomID = query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  if (query.ray.tnear >= max_range) return {};
  rtcIntersect1(implementation_->scene, &context, &query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return {};
  const Eigen::Vector3f normal(query.hit.Ng_x, query.hit.Ng_y, query.hit.Ng_z);
  return {query.ray.tfar, std::abs(normal.normalized().dot(direction)),
          implementation_->surface_of_triangle[query.hit.primID]};
}

bool RayCaster::sees(const Eigen::Vector3f& from, const Eigen::Vector3f& to) const {
  const Eigen::Vector3f offset = to - from;
  const float length = offset.norm();
  if (length <= end_margin) return true;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRay ray{};
  ray.org_x = from.x(), ray.org_y = from.y(), ray.org_z = from.z();
  ray.dir_x = offset.x() / length, ray.dir_y = offset.y() / length, ray.dir_z = offset.z() / length;
  ray.tnear = 0.0F, ray.tfar = length - end_margin, ray.mask = ~0U;
  rtcOccluded1(implementation_->scene, &context, &ray);
  return ray.tfar >= 0.0F;  // Embree sets minus infinity if the ray is occluded
}

double RayCaster::transmission(const Eigen::Vector3f& from, const Eigen::Vector3f& to) const {
  if (sees(from, to)) return 1.0;
  if (!has_glass()) return 0.0;
  const float length = (to - from).norm();
  const Eigen::Vector3f direction = (to - from) / length;
  double share = 1.0;
  for (float range = 0.0F; share > 0.0;) {
    const RayHit hit = cast_beyond(from, direction, range, length - end_margin);
    if (hit.range < 0.0F) break;
    share *= surface(hit).transparency;
    range = hit.range;
  }
  return share;
}

const Surface& RayCaster::surface(const RayHit& hit) const {
  return implementation_->surfaces[hit.surface];
}

bool RayCaster::has_glass() const {
  return implementation_->surfaces.size() > 1;
}

}  // namespace lodestone::simulation

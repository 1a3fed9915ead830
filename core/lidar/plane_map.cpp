#include "core/lidar/plane_map.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/lidar/prefetch_plane.h"

namespace lodestone {

namespace {

constexpr std::uint64_t kEmpty = ~std::uint64_t{0};
constexpr std::int32_t kNoPlane = -1;
constexpr float kSameNormal = 0.9F;  // cosine: planes of one surface in neighbouring voxels

/// Points whose memory is read at once: more than a processor's pending reads, few enough for its first cache.
constexpr std::size_t kPointsAtOnce = 32;

std::uint64_t spread(std::uint64_t key) {
  key *= 0x9E3779B97F4A7C15ULL;
  return key ^ (key >> 29);
}

}  // namespace

PlaneMap::PlaneMap(std::span<const Eigen::Vector3f> points, const PlaneMapOptions& options)
    : options_(options), inverse_voxel_(static_cast<float>(1.0 / options.voxel_m)) {
  const std::vector<VoxelPlane> voxels = fit_voxel_planes(points, options);
  thickness_ = thickness_of(
      [&voxels](const VoxelPlaneVisitor& visit) { std::for_each(voxels.begin(), voxels.end(), visit); }, options);
  insert(voxels);
}

PlaneMap::PlaneMap(std::span<const VoxelPlane> voxels, const PlaneThickness& thickness, const PlaneMapOptions& options)
    : options_(options), inverse_voxel_(static_cast<float>(1.0 / options.voxel_m)), thickness_(thickness) {
  insert(voxels);
}

void PlaneMap::insert(std::span<const VoxelPlane> voxels) {
  const PlaneLimits limits(thickness_, options_);
  const auto counts = [&limits](const VoxelPlane& voxel) { return limits.allow(voxel); };
  planes_.reserve(static_cast<std::size_t>(std::count_if(voxels.begin(), voxels.end(), counts)));
  std::uint64_t capacity = 16;
  while (capacity < 2 * voxels.size()) capacity *= 2;
  mask_ = capacity - 1;
  table_.assign(capacity, {kEmpty, kNoPlane});
  for (const VoxelPlane& voxel : voxels) {
    std::uint64_t slot = first_slot(voxel.key);
    while (table_[slot].key != kEmpty) slot = (slot + 1) & mask_;
    table_[slot] = {voxel.key, kNoPlane};
    if (counts(voxel)) {
      table_[slot].plane = static_cast<std::int32_t>(planes_.size());
      planes_.push_back(with_shared_thickness(voxel.plane, thickness_));
    }
  }
}

void PlaneMap::for_each_voxel(const VoxelVisitor& visit) const {
  for (const Slot& slot : table_) {
    if (slot.key == kEmpty) continue;
    visit(voxel_of_key(slot.key), slot.plane == kNoPlane ? nullptr : &planes_[static_cast<std::size_t>(slot.plane)]);
  }
}

std::uint64_t PlaneMap::first_slot(std::uint64_t key) const {
  return spread(key) & mask_;
}

PlaneMap::Address PlaneMap::address_of(const Eigen::Vector3i& voxel) const {
  const std::uint64_t key = voxel_key(voxel);
  return {key, first_slot(key)};
}

PlaneMap::Found PlaneMap::find(Address address) const {
  for (;; address.slot = (address.slot + 1) & mask_) {
    const Slot& entry = table_[address.slot];
    if (entry.key == address.key) {
      return {true, entry.plane == kNoPlane ? nullptr : &planes_[static_cast<std::size_t>(entry.plane)]};
    }
    if (entry.key == kEmpty) return {false, nullptr};
  }
}

const Plane* PlaneMap::at(const Eigen::Vector3f& point) const {
  return find(address_of(voxel_of(point, inverse_voxel_))).plane;
}

bool PlaneMap::agrees(const Eigen::Vector3f& point, float distance_m) const {
  const Found own = find(address_of(voxel_of(point, inverse_voxel_)));
  if (own.occupied && own.plane == nullptr) return true;
  if (own.plane != nullptr && std::abs(own.plane->distance(point)) <= distance_m) return true;
  return match(point, distance_m) != nullptr;
}

/// The same surface a margin nearer and farther along the normal, in other voxels than `voxel`.
PlaneMap::Sides PlaneMap::sides_of(const Plane& plane, const Eigen::Vector3i& voxel,
                                   const Eigen::Vector3f& point) const {
  Sides result;
  result.count = 0;
  result.foot = point - plane.normal * plane.distance(point);
  const Eigen::Vector3f step = plane.normal * static_cast<float>(options_.margin_m);
  for (const float side : {-1.0F, 0.0F, 1.0F}) {
    const Eigen::Vector3i other = voxel_of(result.foot + side * step, inverse_voxel_);
    if (other == voxel) continue;
    result.others[static_cast<std::size_t>(result.count++)] = address_of(other);
  }
  return result;
}

bool PlaneMap::serves_both_sides(const Plane& plane, const Sides& sides) const {
  for (int i = 0; i < sides.count; ++i) {
    const Found there = find(sides.others[static_cast<std::size_t>(i)]);
    if (!there.occupied) continue;
    if (there.plane == nullptr || std::abs(there.plane->normal.dot(plane.normal)) < kSameNormal ||
        std::abs(there.plane->distance(sides.foot)) > 0.5F * static_cast<float>(options_.margin_m)) {
      return false;
    }
  }
  return true;
}

const Plane* PlaneMap::match(const Eigen::Vector3f& point, float max_distance_m) const {
  Eigen::Vector3i voxel = voxel_of(point, inverse_voxel_);
  const Plane* plane = candidate(find(address_of(voxel)), voxel, point, max_distance_m);
  return plane != nullptr && serves_both_sides(*plane, sides_of(*plane, voxel, point)) ? plane : nullptr;
}

void PlaneMap::match(std::span<const Eigen::Vector3f> points, float max_distance_m,
                     std::span<const Plane*> planes) const {
  struct Place {
    Eigen::Vector3i voxel;
    Address address;
    Found own;
    Sides sides;
  };
  std::array<Place, kPointsAtOnce> places;
  for (std::size_t first = 0; first < points.size(); first += kPointsAtOnce) {
    const std::size_t count = std::min(kPointsAtOnce, points.size() - first);
    for (std::size_t i = 0; i < count; ++i) {
      Place& place = places[i];
      place.voxel = voxel_of(points[first + i], inverse_voxel_);
      place.address = address_of(place.voxel);
      __builtin_prefetch(&table_[place.address.slot]);
    }
    for (std::size_t i = 0; i < count; ++i) {
      places[i].own = find(places[i].address);
      if (places[i].own.plane != nullptr) prefetch_plane(places[i].own.plane);
    }
    for (std::size_t i = 0; i < count; ++i) {
      Place& place = places[i];
      const Plane*& plane = planes[first + i];
      plane = candidate(place.own, place.voxel, points[first + i], max_distance_m);
      if (plane == nullptr) continue;
      place.sides = sides_of(*plane, place.voxel, points[first + i]);
      for (int k = 0; k < place.sides.count; ++k) {
        __builtin_prefetch(&table_[place.sides.others[static_cast<std::size_t>(k)].slot]);
      }
    }
    for (std::size_t i = 0; i < count; ++i) {
      const Plane*& plane = planes[first + i];
      if (plane != nullptr && !serves_both_sides(*plane, places[i].sides)) plane = nullptr;
    }
  }
}

/// The plane for a point in `voxel`, before the test of both sides. `voxel` becomes the plane's.
const Plane* PlaneMap::candidate(const Found& own, Eigen::Vector3i& voxel, const Eigen::Vector3f& point,
                                 float max_distance_m) const {
  if (own.occupied) {
    return own.plane != nullptr && std::abs(own.plane->distance(point)) <= max_distance_m ? own.plane : nullptr;
  }
  const Eigen::Vector3f scaled = point * inverse_voxel_;
  const Plane* best = nullptr;
  Eigen::Vector3i voxel_of_best = voxel;
  float best_distance = max_distance_m;
  for (int axis = 0; axis < 3; ++axis) {
    const float share = scaled[axis] - static_cast<float>(voxel[axis]);
    // The edge must not be further than the largest distance of a match.
    const float beyond = std::min(share, 1.0F - share) * static_cast<float>(options_.voxel_m);
    if (beyond > max_distance_m) continue;
    Eigen::Vector3i neighbour = voxel;
    neighbour[axis] += share < 0.5F ? -1 : 1;
    const Plane* candidate = find(address_of(neighbour)).plane;
    if (candidate == nullptr) continue;
    const float distance = std::abs(candidate->distance(point));
    if (distance <= best_distance) {
      best_distance = distance;
      best = candidate;
      voxel_of_best = neighbour;
    }
  }
  voxel = voxel_of_best;
  return best;
}

}  // namespace lodestone

#include "tools/simulate/moved_objects.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/random_stream.h"
#include "tools/simulate/ray_caster.h"
#include "tools/simulate/route.h"

namespace lodestone::simulation {
namespace {

using Box = Eigen::AlignedBox3d;

constexpr double largest_plan_m = 3.0;
constexpr double largest_height_m = 2.2;  // higher objects may carry the ceiling
constexpr double least_size_m = 0.15;     // thinner objects are boards, posts and signs
constexpr double path_clearance_m = 1.0;
constexpr double path_step_m = 0.25;
constexpr double new_box_slot_m = 4.0;  // length of path for which at most one box is added
constexpr int tries = 20;
constexpr double on_floor_m = 0.1;  // an object whose lower end is below this stands on the floor

class Surroundings {
 public:
  explicit Surroundings(const World& world)
      : instances(list_instances(world)), scene_(build_scene(world)), caster_(scene_.mesh) {
    for (const auto& [name, sequence] : world.sequences) {
      const Route route(sequence.waypoints, sequence.corner_radius_m);
      for (double distance = 0.0; distance <= route.length() + path_step_m; distance += path_step_m)
        path.push_back(route.at(std::min(distance, route.length())).position);
    }
    for (const SolidInstance& instance : instances) {
      const bool is_leaf = instance.solid->parts.empty() && !instance.bounds.isEmpty();
      if (is_leaf && instance.solid->shape != SolidShape::tube) obstacles_.push_back(instance.bounds);
    }
  }

  bool keeps_off_paths(const Box& box) const {
    return std::all_of(path.begin(), path.end(), [&](const Eigen::Vector2d& place) {
      const Vector3 nearest(place.x(), place.y(), box.center().z());
      return box.exteriorDistance(nearest) >= path_clearance_m;
    });
  }

  /// Whether `box` intersects neither a solid's bounds nor an added object. A room around `box`, the floor below it and
  /// `self` do not count.
  bool is_free(const Box& box, const Box& self) const {
    const Vector3 margin(0.02, 0.02, 0.03);
    const Box inner(box.min() + margin, box.max() - margin);
    const auto cuts = [&](const Box& other) {
      return inner.intersects(other) && !other.contains(inner) && !self.contains(other);
    };
    return std::none_of(obstacles_.begin(), obstacles_.end(), cuts) && std::none_of(taken_.begin(), taken_.end(), cuts);
  }

  /// Whether `box` stands on the floor, and all of it is visible from `place` on a path.
  bool is_open(const Box& box, const Eigen::Vector2d& place) const {
    const Eigen::Vector3f eye(static_cast<float>(place.x()), static_cast<float>(place.y()), 0.5F);
    for (int corner = 0; corner < 8; ++corner) {
      const Vector3 point = box.corner(static_cast<Box::CornerType>(corner)) + Vector3(0.0, 0.0, 0.05);
      if (!caster_.sees(eye, point.cast<float>())) return false;
      RayHit hit;
      const Eigen::Vector3f down = -Eigen::Vector3f::UnitZ();
      const Eigen::Vector3f above(static_cast<float>(point.x()), static_cast<float>(point.y()), 0.1F);
      caster_.cast(above, {&down, 1}, 0.2F, {&hit, 1});
      if (!(hit.range > 0.08F && hit.range < 0.12F)) return false;
    }
    return true;
  }

  void take(const Box& box) { taken_.push_back(box); }

  std::vector<SolidInstance> instances;
  std::vector<Eigen::Vector2d> path;  ///< of all sequences, map, m

 private:
  Scene scene_;
  RayCaster caster_;
  std::vector<Box> obstacles_;
  std::vector<Box> taken_;
};

/// Walls, floors and tubes consist of rectangles, tubes or glass: they are never moved.
bool holds_building(const Solid& solid) {
  if (solid.shape == SolidShape::rectangle || solid.shape == SolidShape::tube || solid.transparency > 0.0) return true;
  return std::any_of(solid.parts.begin(), solid.parts.end(), holds_building);
}

bool is_movable(const SolidInstance& instance) {
  if (instance.bounds.isEmpty() || holds_building(*instance.solid)) return false;
  const Vector3 size = instance.bounds.sizes();
  return size.minCoeff() >= least_size_m && size.head<2>().maxCoeff() <= largest_plan_m && size.z() <= largest_height_m;
}

/// Shifts an object and turns it a little. Returns false if no place is found.
bool shift(Surroundings& surroundings, std::size_t number, RandomStream& random, MovedObjects& moved) {
  const SolidInstance& instance = surroundings.instances[number];
  const Box& old_box = instance.bounds;
  // Goods on a shelf are shifted on the shelf.
  const double farthest = old_box.min().z() < on_floor_m ? 2.0 : 0.6;
  for (int attempt = 0; attempt < tries; ++attempt) {
    const double distance = random.uniform(0.3, farthest);
    const double direction = random.uniform(-std::numbers::pi, std::numbers::pi);
    const double turn = random.uniform(-0.2, 0.2);
    const Vector3 step(distance * std::cos(direction), distance * std::sin(direction), 0.0);
    Pose change;
    change.rotation = Eigen::AngleAxisd(turn, Vector3::UnitZ());
    change.position = old_box.center() + step - change.rotation * old_box.center();
    const Vector3 half = 0.5 * old_box.sizes();
    const double cosine = std::cos(turn), sine = std::abs(std::sin(turn));
    const Vector3 new_half(cosine * half.x() + sine * half.y(), sine * half.x() + cosine * half.y(), half.z());
    const Box new_box(old_box.center() + step - new_half, old_box.center() + step + new_half);
    if (!surroundings.keeps_off_paths(new_box) || !surroundings.is_free(new_box, old_box)) continue;
    surroundings.take(new_box);
    moved.driven.moved[number] = change;
    moved.list.push_back({ObjectChange::shifted, instance.name, old_box.sizes(), old_box.center(), new_box.center()});
    return true;
  }
  return false;
}

/// Adds a box on the floor beside a path, half of the boxes with steel. Does nothing if there is no room.
void add_box(Surroundings& surroundings, std::size_t slot, RandomStream& random, MovedObjects& moved) {
  const auto per_slot = static_cast<std::size_t>(new_box_slot_m / path_step_m);
  for (int attempt = 0; attempt < tries; ++attempt) {
    const double share = random.uniform();
    const std::size_t index = slot * per_slot + static_cast<std::size_t>(share * static_cast<double>(per_slot));
    const Eigen::Vector2d place = surroundings.path[std::min(index, surroundings.path.size() - 1)];
    const double distance = random.uniform(1.5, 5.0);
    const double direction = random.uniform(-std::numbers::pi, std::numbers::pi);
    Solid solid;
    solid.name = "added box " + std::to_string(slot);
    solid.shape = SolidShape::box;
    for (int axis = 0; axis < 3; ++axis) solid.size[axis] = random.uniform(0.4, 1.2);
    solid.placement.position = {place.x() + distance * std::cos(direction), place.y() + distance * std::sin(direction),
                                0.5 * solid.size.z()};
    const bool has_steel = random.uniform() < 0.5;
    const Vector3 center = solid.placement.position;
    const Box box(center - 0.5 * solid.size, center + 0.5 * solid.size);
    if (!surroundings.keeps_off_paths(box) || !surroundings.is_free(box, Box{}) || !surroundings.is_open(box, place))
      continue;
    if (has_steel) {
      Steel steel;  // e.g. a pallet with machine parts
      steel.moment_sigma = 15.0;
      solid.steel.push_back(steel);
    }
    surroundings.take(box);
    moved.list.push_back({ObjectChange::added, solid.name, solid.size, center, center});
    moved.driven.added.push_back(std::move(solid));
    return;
  }
}

}  // namespace

MovedObjects draw_moved_objects(const World& world, std::uint64_t seed) {
  MovedObjects moved;
  const double share = world.reality.moved_objects_share;
  if (!(share > 0.0)) return moved;
  Surroundings surroundings(world);
  for (std::size_t number = 0; number < surroundings.instances.size();) {
    const SolidInstance& instance = surroundings.instances[number];
    if (!is_movable(instance)) {
      ++number;
      continue;
    }
    RandomStream random(seed, "reality moved object", number);
    if (random.uniform() < share) {
      const double kind = random.uniform();
      const Vector3 center = instance.bounds.center(), size = instance.bounds.sizes();
      if (kind < 1.0 / 3.0) {
        moved.mapped.gone.insert(number);
        moved.list.push_back({ObjectChange::added, instance.name, size, center, center});
      } else if (kind < 2.0 / 3.0 || !shift(surroundings, number, random, moved)) {
        moved.driven.gone.insert(number);
        moved.list.push_back({ObjectChange::gone, instance.name, size, center, center});
      }
    }
    number = instance.end;  // skips the instance's parts
  }
  const auto slots =
      static_cast<std::size_t>(static_cast<double>(surroundings.path.size()) * path_step_m / new_box_slot_m);
  for (std::size_t slot = 0; slot < slots; ++slot) {
    RandomStream random(seed, "reality added box", slot);
    if (random.uniform() < share) add_box(surroundings, slot, random, moved);
  }
  return moved;
}

}  // namespace lodestone::simulation

#include "tools/simulate/scene.h"

#include <cmath>
#include <functional>
#include <numbers>

#include "core/random_stream.h"

namespace lodestone::simulation {
namespace {

using ToMap = std::function<Vector3(const Vector3&)>;

/// Adds steel. Each piece has its own random stream, numbered in file order within `purpose`.
class SteelBuilder {
 public:
  SteelBuilder(std::uint64_t seed, std::string purpose, std::vector<FieldSource>& sources)
      : seed_(seed), purpose_(std::move(purpose)), sources_(sources) {}

  void add(const Solid& solid, const Steel& steel, const ToMap& to_map) {
    RandomStream random(seed_, purpose_, next_stream_++);
    switch (steel.kind) {
      case SteelKind::dipole:
        return add_dipole(steel, steel.region_min, to_map, random);
      case SteelKind::bar:
        return add_bar(steel, steel.region_min, steel.region_max, to_map, random);
      case SteelKind::dipoles:
        for (int i = count(steel, random); i > 0; --i) add_dipole(steel, place(steel, random), to_map, random);
        return;
      case SteelKind::rods:
        for (int i = count(steel, random); i > 0; --i) add_rod(steel, to_map, random);
        return;
      case SteelKind::rings:
        return add_rings(solid, steel, to_map, random);
    }
  }

 private:
  static int count(const Steel& steel, RandomStream& random) {
    const Vector3 extent = steel.region_max - steel.region_min;
    return static_cast<int>(std::floor(steel.density_per_m2 * extent.x() * extent.y() + random.uniform()));
  }

  static Vector3 place(const Steel& steel, RandomStream& random) {
    Vector3 position;
    for (int axis = 0; axis < 3; ++axis)
      position[axis] = random.uniform(steel.region_min[axis], steel.region_max[axis]);
    return position;
  }

  void add_dipole(const Steel& steel, const Vector3& position, const ToMap& to_map, RandomStream& random) {
    FieldSource source;
    source.position = to_map(position);
    // The moment turns with the solid: the solid's axes at this place, in the map frame.
    const Vector3 moment = steel.moment + steel.moment_sigma * random.normal3();
    for (int axis = 0; axis < 3; ++axis) {
      const Vector3 step = 1e-3 * Vector3::Unit(axis);
      source.moment += moment[axis] * (to_map(position + step) - to_map(position - step)).normalized();
    }
    sources_.push_back(source);
  }

  void add_bar(const Steel& steel, const Vector3& from, const Vector3& to, const ToMap& to_map, RandomStream& random) {
    FieldSource source;
    source.is_bar = true;
    source.south = to_map(from);
    source.position = to_map(to);
    const double length = (source.position - source.south).norm();
    if (length <= 0.0) return;
    source.pole = (steel.moment.x() + steel.moment_sigma * random.normal()) / length;
    sources_.push_back(source);
  }

  void add_rod(const Steel& steel, const ToMap& to_map, RandomStream& random) {
    const Vector3 center = place(steel, random);
    const double length = random.uniform(steel.length_m[0], steel.length_m[1]);
    const double degrees = steel.angle_deg + steel.angle_spread_deg * random.uniform(-1.0, 1.0);
    const double angle = degrees * std::numbers::pi / 180.0;
    const Vector3 half = 0.5 * length * Vector3(std::cos(angle), std::sin(angle), 0.0);
    add_bar(steel, center - half, center + half, to_map, random);
  }

  void add_rings(const Solid& solid, const Steel& steel, const ToMap& to_map, RandomStream& random) {
    const int rings = 1 + static_cast<int>(std::floor((steel.region_max.x() - steel.region_min.x()) / steel.spacing_m));
    for (int ring = 0; ring < rings; ++ring) {
      const auto corner = [&](int segment) {
        const double angle = 2.0 * std::numbers::pi * segment / steel.ring_segments;
        return Vector3(steel.region_min.x() + ring * steel.spacing_m, steel.ring_radius_m * std::cos(angle),
                       solid.tube_center_height_m + steel.ring_radius_m * std::sin(angle));
      };
      for (int segment = 0; segment < steel.ring_segments; ++segment)
        add_bar(steel, corner(segment), corner(segment + 1), to_map, random);
    }
  }

  std::uint64_t seed_;
  std::string purpose_;
  std::vector<FieldSource>& sources_;
  std::uint64_t next_stream_ = 0;
};

/// Places solids in order, and numbers them.
class Placer {
 public:
  /// `instances`: receives the placed instances; may be null.
  Placer(Scene& scene, const Rearrangement& rearrangement, std::vector<SolidInstance>* instances)
      : scene_(scene), rearrangement_(rearrangement), instances_(instances) {}

  void place(const Solid& solid, const Pose& T_map_parent, const std::string& parent_name, SteelBuilder& builder) {
    const std::string& name = solid.name.empty() ? parent_name : solid.name;
    for (int i = 0; i < solid.repeat_count[0]; ++i) {
      for (int j = 0; j < solid.repeat_count[1]; ++j) {
        for (int k = 0; k < solid.repeat_count[2]; ++k) {
          Pose step;
          step.position = solid.repeat_step.cwiseProduct(Vector3(i, j, k));
          place_one(solid, T_map_parent * solid.placement * step, name, builder);
        }
      }
    }
  }

 private:
  void place_one(const Solid& solid, Pose pose, const std::string& name, SteelBuilder& builder) {
    const std::size_t number = next_++;
    const auto moved = rearrangement_.moved.find(number);
    if (moved != rearrangement_.moved.end()) pose = moved->second * pose;
    const std::size_t vertices = scene_.mesh.vertices.size(), triangles = scene_.mesh.triangles.size();
    const std::size_t sources = scene_.sources.size();
    if (instances_ != nullptr) instances_->push_back({&solid, name, 0, {}});
    append_shape(solid, pose, scene_.mesh);
    const ToMap to_map = [&](const Vector3& local) {
      return pose * (solid.shape == SolidShape::tube ? tube_point(solid, local) : local);
    };
    for (const Steel& steel : solid.steel) builder.add(solid, steel, to_map);
    for (const Solid& part : solid.parts) place(part, pose, name, builder);
    if (instances_ != nullptr) {
      SolidInstance& instance = (*instances_)[number];
      instance.end = next_;
      for (std::size_t v = vertices; v < scene_.mesh.vertices.size(); ++v)
        instance.bounds.extend(scene_.mesh.vertices[v].cast<double>());
    }
    if (rearrangement_.gone.count(number) == 0) return;
    // The solid is placed and removed again: all other steel keeps its random stream.
    scene_.mesh.vertices.resize(vertices);
    scene_.mesh.triangles.resize(triangles);
    scene_.mesh.surface_of_triangle.resize(triangles);
    scene_.sources.resize(sources);
  }

  Scene& scene_;
  const Rearrangement& rearrangement_;
  std::vector<SolidInstance>* instances_;
  std::size_t next_ = 0;
};

}  // namespace

std::vector<SolidInstance> list_instances(const World& world) {
  Scene scene;
  SteelBuilder builder(world.steel_seed, "steel", scene.sources);
  const Rearrangement as_in_the_file;
  std::vector<SolidInstance> instances;
  Placer placer(scene, as_in_the_file, &instances);
  for (const Solid& solid : world.solids) placer.place(solid, Pose{}, {}, builder);
  return instances;
}

Scene build_scene(const World& world, const std::string& scene_name, const Rearrangement& rearrangement) {
  Scene scene;
  SteelBuilder builder(world.steel_seed, "steel", scene.sources);
  Placer placer(scene, rearrangement, nullptr);
  for (const Solid& solid : world.solids) placer.place(solid, Pose{}, {}, builder);
  const Rearrangement as_in_the_file;
  const auto add = [&](const Solid& solid, const std::string& identity) {
    SteelBuilder own_builder(world.steel_seed, "steel of " + identity, scene.sources);
    Placer(scene, as_in_the_file, nullptr).place(solid, Pose{}, {}, own_builder);
  };
  std::size_t index = 0;
  for (const Solid& solid : find_scene(world, scene_name)) {
    add(solid, solid.name.empty() ? scene_name + " " + std::to_string(index) : solid.name);
    ++index;
  }
  for (const Solid& solid : rearrangement.added) add(solid, solid.name);
  return scene;
}

}  // namespace lodestone::simulation

#include <fmt/format.h>

#include <cmath>
#include <map>

#include "frontends/configuration/configuration_node.h"
#include "frontends/configuration/file_kind.h"
#include "frontends/configuration/options.h"
#include "tools/simulate/world.h"

namespace lodestone::simulation {
namespace {

constexpr int deepest_template = 8;
constexpr double largest_count = 1.0e5;

/// One map of the file. Records the requested keys, so that all others can be rejected.
class Section {
 public:
  explicit Section(const ConfigurationNode& node) : node_(node) {}

  const ConfigurationNode* find(const std::string& key) {
    known_.push_back(key);
    return node_.find(key);
  }
  const ConfigurationNode& at(const std::string& key) {
    known_.push_back(key);
    return node_.at(key);
  }
  double number(const std::string& key) { return at(key).as_double(); }
  double number(const std::string& key, double fallback) {
    const ConfigurationNode* child = find(key);
    return child != nullptr ? child->as_double() : fallback;
  }
  std::string text(const std::string& key) {
    const ConfigurationNode* child = find(key);
    return child != nullptr ? child->as_string() : std::string{};
  }
  Vector3 vector(const std::string& key) { return Vector3(at(key).as_doubles(3).data()); }
  Vector3 vector(const std::string& key, const Vector3& fallback) {
    return node_.has(key) ? vector(key) : (known_.push_back(key), fallback);
  }
  template <class Enum>
  Enum choice(const std::string& key, Enum fallback) {
    if (const ConfigurationNode* child = find(key)) options_detail::read_value(*child, fallback);
    return fallback;
  }
  template <class Options>
  void options(const std::string& key, Options& options) {
    if (const ConfigurationNode* child = find(key)) load_options(*child, options);
  }
  void require(bool holds, const std::string& key, const char* expected) const {
    if (!holds) node_.at(key).fail(std::string("must be ") + expected);
  }
  /// Rounded down. The bounds are checked as double, before the conversion: out-of-range values must not be converted.
  std::int64_t integer(const std::string& key, double fallback, double least, double most) {
    const double value = number(key, fallback);
    if (!(value >= least && value <= most)) node_.at(key).fail(fmt::format("must be {:.0f} to {:.0f}", least, most));
    return static_cast<std::int64_t>(std::floor(value));
  }
  void finish() const { node_.refuse_keys_other_than(known_); }

 private:
  const ConfigurationNode& node_;
  std::vector<std::string> known_;
};

Steel read_steel(const ConfigurationNode& node) {
  Section section(node);
  Steel steel;
  section.at("kind");
  steel.kind = section.choice("kind", steel.kind);
  if (steel.kind == SteelKind::dipole) {
    steel.region_min = steel.region_max = section.vector("at_m");
    steel.moment = section.vector("moment_a_m2", Vector3::Zero());
  } else {
    steel.region_min = section.vector("from_m");
    steel.region_max = section.vector("to_m");
    steel.moment.x() = section.number("moment_a_m2", 0.0);
    section.require(steel.kind == SteelKind::bar || (steel.region_max.array() >= steel.region_min.array()).all(),
                    "to_m", "at least from_m in x, y and z");
  }
  if (steel.kind == SteelKind::dipoles || steel.kind == SteelKind::rods) {
    steel.density_per_m2 = section.number("density_per_m2");
    section.require(steel.density_per_m2 >= 0.0 && steel.density_per_m2 <= 1000.0, "density_per_m2", "0 to 1000");
  }
  if (steel.kind == SteelKind::rods) {
    const auto length = section.at("length_m").as_doubles(2);
    steel.length_m = {length[0], length[1]};
    section.require(length[0] > 0.0 && length[1] >= length[0], "length_m", "[shortest, longest], above 0");
    steel.angle_deg = section.number("angle_deg", steel.angle_deg);
    steel.angle_spread_deg = section.number("angle_spread_deg", steel.angle_spread_deg);
  }
  if (steel.kind == SteelKind::rings) {
    steel.spacing_m = section.number("spacing_m");
    steel.ring_radius_m = section.number("radius_m");
    steel.ring_segments = static_cast<int>(section.integer("segments", steel.ring_segments, 3, 1000));
    section.require(steel.spacing_m >= 0.01, "spacing_m", "at least 0.01");
  }
  steel.moment_sigma = section.number("moment_sigma_a_m2", 0.0);
  section.finish();
  return steel;
}

std::vector<Solid> read_solids(const ConfigurationNode& list, const ConfigurationNode* templates, int depth);

void read_shape(Section& section, const ConfigurationNode* templates, int depth, Solid& solid) {
  if (const ConfigurationNode* name = section.find("template")) {
    if (templates == nullptr || !templates->has(name->as_string()))
      name->fail("there is no template '" + name->as_string() + "' under templates");
    if (depth >= deepest_template) name->fail("templates are nested too deep (does one contain itself?)");
    solid.parts = read_solids(templates->at(name->as_string()), templates, depth + 1);
    return;
  }
  section.at("shape");
  solid.shape = section.choice("shape", solid.shape);
  solid.facet_m = section.number("facet_m", solid.facet_m);
  section.require(solid.facet_m >= 0.01, "facet_m", "at least 0.01");
  solid.transparency = section.number("transparency", solid.transparency);
  section.require(solid.transparency >= 0.0 && solid.transparency <= 1.0, "transparency", "0 to 1");
  solid.max_incidence_deg = section.number("max_incidence_deg", solid.max_incidence_deg);
  section.require(solid.max_incidence_deg > 0.0 && solid.max_incidence_deg <= 90.0, "max_incidence_deg",
                  "above 0, at most 90");
  switch (solid.shape) {
    case SolidShape::group:
      return;
    case SolidShape::rectangle: {
      const auto size = section.at("size_m").as_doubles(2);
      solid.size = {size[0], size[1], 0.0};
      return;
    }
    case SolidShape::box:
      solid.size = section.vector("size_m");
      return;
    case SolidShape::cylinder:
      solid.radius_m = section.number("radius_m");
      solid.height_m = section.number("height_m");
      section.require(solid.radius_m > 0.0, "radius_m", "above 0");
      return;
    case SolidShape::tube:
      solid.radius_m = section.number("radius_m");
      solid.tube_center_height_m = section.number("center_height_m");
      solid.tube_begin_m = section.number("begin_m");
      solid.tube_end_m = section.number("end_m");
      const double turn = section.number("curvature_radius_m", 0.0);
      solid.tube_curvature_per_m = turn == 0.0 ? 0.0 : 1.0 / turn;
      section.require(solid.tube_end_m > solid.tube_begin_m, "end_m", "more than begin_m");
      section.require(std::abs(solid.tube_center_height_m) < solid.radius_m, "center_height_m", "less than radius_m");
      section.require(turn == 0.0 || std::abs(turn) > solid.radius_m, "curvature_radius_m", "0, or more than radius_m");
      return;
  }
}

Solid read_solid(const ConfigurationNode& node, const ConfigurationNode* templates, int depth) {
  Section section(node);
  Solid solid;
  solid.name = section.text("name");
  const Vector3 position = section.vector("at_m", Vector3::Zero());
  const Vector3 angles = section.vector("rotation_rpy_deg", Vector3::Zero());
  solid.placement = mounting_pose({position.x(), position.y(), position.z()}, {angles.x(), angles.y(), angles.z()});
  read_shape(section, templates, depth, solid);
  if (const ConfigurationNode* child = section.find("repeat")) {
    Section repeat(*child);
    const Vector3 count = repeat.vector("count");
    for (int axis = 0; axis < 3; ++axis) {
      const bool good = count[axis] >= 1.0 && count[axis] <= largest_count && count[axis] == std::floor(count[axis]);
      repeat.require(good, "count", "three whole numbers, at least 1");
      solid.repeat_count[axis] = static_cast<int>(count[axis]);
    }
    solid.repeat_step = repeat.vector("step_m");
    repeat.finish();
  }
  if (const ConfigurationNode* list = section.find("steel")) {
    for (const ConfigurationNode& element : list->elements()) solid.steel.push_back(read_steel(element));
  }
  section.finish();
  return solid;
}

std::vector<Solid> read_solids(const ConfigurationNode& list, const ConfigurationNode* templates, int depth) {
  std::vector<Solid> solids;
  for (const ConfigurationNode& element : list.elements()) solids.push_back(read_solid(element, templates, depth));
  return solids;
}

void read_sensors(const ConfigurationNode& node, World& world) {
  Section section(node);
  section.options("lidar", world.lidar);
  section.options("imu", world.imu);
  section.options("magnetometers", world.magnetometers);
  if (const ConfigurationNode* list = section.find("magnetometer_mounts")) {
    for (const ConfigurationNode& element : list->elements()) {
      MagnetometerMount mount;
      mount.name = "magnetometer_" + std::to_string(world.magnetometers.mounts.size());
      load_options(element, mount);
      world.magnetometers.mounts.push_back(mount);
    }
  }
  if (const ConfigurationNode* wheels = section.find("wheels")) load_options(*wheels, world.wheels.emplace());
  section.finish();
}

std::vector<Eigen::Vector2d> read_path(const ConfigurationNode& list, const Solid* tube) {
  std::vector<Eigen::Vector2d> path;
  for (const ConfigurationNode& element : list.elements()) {
    const auto point = element.as_doubles(2);
    Vector3 position(point[0], point[1], 0.0);
    if (tube != nullptr) position = tube->placement * tube_point(*tube, position);
    if (!path.empty() && (position.head<2>() - path.back()).norm() < 0.01)
      element.fail("is the same place as the way-point before it");
    path.emplace_back(position.head<2>());
  }
  if (path.size() < 2) list.fail("must be at least two points");
  return path;
}

Sequence read_sequence(const ConfigurationNode& node, const std::vector<Solid>& solids) {
  Section section(node);
  Sequence sequence;
  const Solid* tube = nullptr;
  if (const ConfigurationNode* along = section.find("along")) {
    for (const Solid& solid : solids)
      if (solid.name == along->as_string() && solid.shape == SolidShape::tube) tube = &solid;
    if (tube == nullptr) along->fail("there is no tube called '" + along->as_string() + "' among the solids");
  }
  sequence.waypoints = read_path(section.at("waypoints_m"), tube);
  if (const ConfigurationNode* list = section.find("survey_waypoints_m"))
    sequence.survey_waypoints = read_path(*list, tube);
  for (const ConfigurationNode& element : section.at("speed").elements()) {
    const auto pair = element.as_doubles(2);
    if (pair[1] <= 0.0) element.fail("must be [distance_m, speed_m_s] with a speed above 0");
    if (!sequence.speed.empty() && pair[0] < sequence.speed.back().distance_m)
      element.fail("distances must not decrease");
    sequence.speed.push_back({pair[0], pair[1]});
  }
  section.require(!sequence.speed.empty(), "speed", "a list of at least one [distance_m, speed_m_s]");
  sequence.corner_radius_m = section.number("corner_radius_m", sequence.corner_radius_m);
  sequence.acceleration_m_s2 = section.number("acceleration_m_s2", sequence.acceleration_m_s2);
  sequence.max_yaw_rate_rad_s = section.number("max_yaw_rate_rad_s", sequence.max_yaw_rate_rad_s);
  sequence.rest_s = section.number("rest_s", sequence.rest_s);
  sequence.scene = section.text("scene");
  section.require(sequence.acceleration_m_s2 > 0.0, "acceleration_m_s2", "above 0");
  section.require(sequence.max_yaw_rate_rad_s > 0.0, "max_yaw_rate_rad_s", "above 0");
  section.require(sequence.rest_s >= 0.0, "rest_s", "at least 0");
  section.find("faults");  // read later, when the magnetometers' names are known
  section.finish();
  return sequence;
}

void read_scenes(const ConfigurationNode& scenes, const ConfigurationNode* templates, World& world) {
  for (const std::string& name : scenes.keys()) {
    const ConfigurationNode& node = scenes.at(name);
    if (name == no_scene) node.fail("this name stands for the world without a scene; choose another");
    Section section(node);
    world.scenes[name] = read_solids(section.at("solids"), templates, 0);
    section.finish();
  }
}

/// Checks that a scene named by a key of the file exists; reads nothing of the scene.
void check_scene(const World& world, const ConfigurationNode& owner, const std::string& name) {
  if (name.empty() || world.scenes.count(name) != 0) return;
  const std::string names = join_names(world.scenes, &std::map<std::string, std::vector<Solid>>::value_type::first);
  owner.at("scene").fail("there is no scene '" + name + "' under scenes" +
                         (names.empty() ? "" : " (known: " + names + ")"));
}

}  // namespace

World load_world(const std::string& path, const std::vector<std::string>& assignments) {
  require_kind(path, SeemingKind::world, "a world (config/worlds/)");
  ConfigurationNode root = ConfigurationNode::load(path);
  for (const std::string& assignment : assignments) root.set(assignment);
  Section section(root);
  World world;
  world.file = path;
  world.name = section.text("name");
  // Whole numbers up to 2^53 are exact in a double. A ROS 1 bag stores seconds in 32 bits, less some days for the
  // drive.
  world.steel_seed = static_cast<std::uint64_t>(section.integer("steel_seed", 1.0, 0.0, 9007199254740992.0));
  world.start_time = section.integer("start_time_s", 1.7e9, 0.0, 4294000000.0) * 1'000'000'000;
  world.gravity_m_s2 = section.number("gravity_m_s2", world.gravity_m_s2);
  world.earth_field_ut = section.vector("earth_field_ut");
  section.options("floor", world.floor);
  section.options("cloud", world.cloud);
  section.options("survey", world.survey);
  if (const ConfigurationNode* reality = section.find("reality")) world.reality = read_reality(*reality);
  if (const ConfigurationNode* sensors = section.find("sensors")) read_sensors(*sensors, world);
  const ConfigurationNode* templates = section.find("templates");
  world.solids = read_solids(section.at("solids"), templates, 0);
  if (const ConfigurationNode* scenes = section.find("scenes")) read_scenes(*scenes, templates, world);
  if (const ConfigurationNode* cloud = section.find("cloud")) check_scene(world, *cloud, world.cloud.scene);
  const ConfigurationNode& sequences = section.at("sequences");
  std::vector<std::string> magnetometers;
  for (const MagnetometerMount& mount : world.magnetometers.mounts) magnetometers.push_back(mount.name);
  std::vector<Fault> faults;
  const bool has_wheels = world.wheels.has_value();
  if (const ConfigurationNode* list = section.find("faults")) faults = read_faults(*list, magnetometers, has_wheels);
  for (const std::string& name : sequences.keys()) {
    Sequence& sequence = world.sequences[name] = read_sequence(sequences.at(name), world.solids);
    check_scene(world, sequences.at(name), sequence.scene);
    sequence.faults = faults;
    if (const ConfigurationNode* list = sequences.at(name).find("faults")) {
      for (Fault& fault : read_faults(*list, magnetometers, has_wheels)) sequence.faults.push_back(std::move(fault));
    }
  }
  section.require(!world.sequences.empty(), "sequences", "a map of at least one sequence");
  section.finish();
  return world;
}

}  // namespace lodestone::simulation

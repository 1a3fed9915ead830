#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "frontends/simulation/world.h"
#include "frontends/simulation/yaml_section.h"

namespace lodestone::simulation {
namespace {

using Templates = std::map<std::string, YAML::Node>;
constexpr int deepest_template = 8;

void require(bool holds, const YamlSection& section, const std::string& key, const char* expected) {
  if (!holds) section.fail(key, std::string("must be ") + expected);
}

YAML::Node required_list(YamlSection& section, const std::string& key) {
  YAML::Node list = section.required(key);
  if (!list.IsSequence()) section.fail(key, "expected a list");
  return list;
}

Steel read_steel(const YAML::Node& node, const std::string& where) {
  YamlSection section(node, where);
  static const std::map<std::string, Steel::Kind> kinds = {{"dipole", Steel::Kind::dipole},
                                                           {"bar", Steel::Kind::bar},
                                                           {"dipoles", Steel::Kind::dipoles},
                                                           {"rods", Steel::Kind::rods},
                                                           {"rings", Steel::Kind::rings}};
  const auto kind = kinds.find(section.text("kind", ""));
  if (kind == kinds.end()) section.fail("kind", "must be dipole, bar, dipoles, rods or rings");
  Steel steel;
  steel.kind = kind->second;
  if (steel.kind == Steel::Kind::dipole) {
    steel.region_min = steel.region_max = section.vector("at_m");
    steel.moment = section.vector("moment_a_m2", Vector3::Zero());
  } else {
    steel.region_min = section.vector("from_m");
    steel.region_max = section.vector("to_m");
    steel.moment.x() = section.number("moment_a_m2", 0.0);
    if (steel.kind != Steel::Kind::bar)
      require((steel.region_max.array() >= steel.region_min.array()).all(), section, "to_m", "at least from_m");
  }
  if (steel.kind == Steel::Kind::dipoles || steel.kind == Steel::Kind::rods) {
    steel.density_per_m2 = section.number("density_per_m2");
    require(steel.density_per_m2 >= 0.0, section, "density_per_m2", "at least 0");
  }
  if (steel.kind == Steel::Kind::rods) {
    const auto length = section.numbers("length_m", 2);
    steel.length_m = {length[0], length[1]};
    require(length[0] > 0.0 && length[1] >= length[0], section, "length_m", "[shortest, longest], above 0");
    steel.angle_deg = section.number("angle_deg", steel.angle_deg);
    steel.angle_spread_deg = section.number("angle_spread_deg", steel.angle_spread_deg);
  }
  if (steel.kind == Steel::Kind::rings) {
    steel.spacing_m = section.number("spacing_m");
    steel.ring_radius_m = section.number("radius_m");
    section.field("segments", steel.ring_segments, "");
    require(steel.spacing_m > 0.0, section, "spacing_m", "above 0");
    require(steel.ring_segments >= 3, section, "segments", "at least 3");
  }
  steel.moment_sigma = section.number("moment_sigma_a_m2", 0.0);
  section.finish();
  return steel;
}

std::vector<Solid> read_solids(const YAML::Node& list, const std::string& where, const Templates& templates, int depth);

void read_shape(YamlSection& section, Solid& solid, const Templates& templates, int depth) {
  const std::string shape = section.text("shape", "");
  if (shape == "rectangle") {
    solid.shape = Solid::Shape::rectangle;
    const auto size = section.numbers("size_m", 2);
    solid.size = {size[0], size[1], 0.0};
  } else if (shape == "box") {
    solid.shape = Solid::Shape::box;
    solid.size = section.vector("size_m");
  } else if (shape == "cylinder") {
    solid.shape = Solid::Shape::cylinder;
    solid.radius_m = section.number("radius_m");
    solid.height_m = section.number("height_m");
    require(solid.radius_m > 0.0, section, "radius_m", "above 0");
  } else if (shape == "tube") {
    solid.shape = Solid::Shape::tube;
    solid.radius_m = section.number("radius_m");
    solid.tube_center_height_m = section.number("center_height_m");
    solid.tube_begin_m = section.number("begin_m");
    solid.tube_end_m = section.number("end_m");
    const double turn = section.number("curvature_radius_m", 0.0);
    solid.tube_curvature_per_m = turn == 0.0 ? 0.0 : 1.0 / turn;
    require(solid.tube_end_m > solid.tube_begin_m, section, "end_m", "more than begin_m");
    require(std::abs(solid.tube_center_height_m) < solid.radius_m, section, "center_height_m", "less than radius_m");
    require(turn == 0.0 || std::abs(turn) > solid.radius_m, section, "curvature_radius_m", "more than radius_m, or 0");
  } else if (section.has("template")) {
    const std::string name = section.text("template", "");
    const auto found = templates.find(name);
    if (found == templates.end()) section.fail("template", "there is no template '" + name + "' under templates");
    if (depth >= deepest_template) section.fail("template", "templates are nested too deep (does one contain itself?)");
    solid.parts = read_solids(found->second, section.name_of("template") + " " + name, templates, depth + 1);
  } else {
    section.fail("shape", "must be rectangle, box, cylinder or tube (or name a 'template')");
  }
  solid.facet_m = section.number("facet_m", solid.facet_m);
  require(solid.facet_m > 0.0, section, "facet_m", "above 0");
}

Solid read_solid(const YAML::Node& node, const std::string& where, const Templates& templates, int depth) {
  YamlSection section(node, where);
  Solid solid;
  solid.name = section.text("name", "");
  solid.placement = read_pose(section, "at_m");
  read_shape(section, solid, templates, depth);
  if (section.has("repeat")) {
    YamlSection repeat = section.section("repeat");
    const auto count = repeat.numbers("count", 3);
    for (int axis = 0; axis < 3; ++axis) {
      require(count[axis] >= 1.0 && count[axis] == std::floor(count[axis]), repeat, "count", "whole numbers, at least 1");
      solid.repeat_count[axis] = static_cast<int>(count[axis]);
    }
    solid.repeat_step = repeat.vector("step_m");
    repeat.finish();
  }
  if (section.has("steel")) {
    const YAML::Node list = required_list(section, "steel");
    for (std::size_t i = 0; i < list.size(); ++i)
      solid.steel.push_back(read_steel(list[i], section.name_of("steel") + "." + std::to_string(i)));
  }
  section.finish();
  return solid;
}

std::vector<Solid> read_solids(const YAML::Node& list, const std::string& where, const Templates& templates,
                               int depth) {
  std::vector<Solid> solids;
  for (std::size_t i = 0; i < list.size(); ++i)
    solids.push_back(read_solid(list[i], where + "." + std::to_string(i), templates, depth));
  return solids;
}

void read_sensors(YamlSection section, World& world) {
  YamlSection lidar = section.section("lidar");
  LidarOptions& l = world.lidar;
  lidar.field("rows", l.rows, "");
  lidar.field("columns", l.columns, "");
  lidar.field("vertical_field_of_view_deg", l.vertical_field_of_view_deg, "");
  lidar.field("rate_hz", l.rate_hz, "");
  lidar.field("first_scan_s", l.first_scan_s, "");
  lidar.field("min_range_m", l.min_range_m, "");
  lidar.field("max_range_m", l.max_range_m, "");
  lidar.field("range_noise_m", l.range_noise_m, "");
  lidar.field("max_incidence_deg", l.max_incidence_deg, "");
  lidar.field("dropout_probability", l.dropout_probability, "");
  l.T_imu_lidar = read_pose(lidar, "position_m");
  require(l.rows >= 1, lidar, "rows", "at least 1");
  require(l.columns >= 1, lidar, "columns", "at least 1");
  require(l.rate_hz > 0.0, lidar, "rate_hz", "above 0");
  require(l.max_range_m > l.min_range_m, lidar, "max_range_m", "more than min_range_m");
  lidar.finish();

  YamlSection imu = section.section("imu");
  ImuOptions& i = world.imu;
  imu.field("rate_hz", i.rate_hz, "");
  imu.field("height_m", i.height_m, "");
  imu.field("gyroscope_noise_rad_s_sqrt_hz", i.gyroscope_noise_rad_s_sqrt_hz, "");
  imu.field("accelerometer_noise_m_s2_sqrt_hz", i.accelerometer_noise_m_s2_sqrt_hz, "");
  imu.field("gyroscope_bias_walk_rad_s2_sqrt_hz", i.gyroscope_bias_walk_rad_s2_sqrt_hz, "");
  imu.field("accelerometer_bias_walk_m_s3_sqrt_hz", i.accelerometer_bias_walk_m_s3_sqrt_hz, "");
  imu.field("gyroscope_bias_sigma_rad_s", i.gyroscope_bias_sigma_rad_s, "");
  imu.field("accelerometer_bias_sigma_m_s2", i.accelerometer_bias_sigma_m_s2, "");
  require(i.rate_hz > 0.0, imu, "rate_hz", "above 0");
  imu.finish();

  YamlSection magnetometers = section.section("magnetometers");
  MagnetometerOptions& m = world.magnetometers;
  magnetometers.field("rate_hz", m.rate_hz, "");
  magnetometers.field("offset_s", m.offset_s, "");
  magnetometers.field("noise_ut", m.noise_ut, "");
  require(m.rate_hz > 0.0, magnetometers, "rate_hz", "above 0");
  require(m.noise_ut >= 0.0, magnetometers, "noise_ut", "at least 0");
  if (magnetometers.has("mounts")) {
    const YAML::Node mounts = required_list(magnetometers, "mounts");
    for (std::size_t k = 0; k < mounts.size(); ++k) {
      YamlSection mount(mounts[k], magnetometers.name_of("mounts") + "." + std::to_string(k));
      m.mounts.push_back({mount.text("name", "magnetometer_" + std::to_string(k)), read_pose(mount, "position_m")});
      mount.finish();
    }
  }
  magnetometers.finish();
  section.finish();
}

void read_floor(YamlSection section, FloorOptions& floor) {
  section.field("height_sigma_m", floor.height_sigma_m, "");
  section.field("tilt_sigma_deg", floor.tilt_sigma_deg, "");
  section.field("slip_yaw_sigma_deg", floor.slip_yaw_sigma_deg, "");
  section.field("slow_correlation_s", floor.slow_correlation_s, "");
  section.field("vibration_height_m", floor.vibration_height_m, "");
  section.field("vibration_tilt_deg", floor.vibration_tilt_deg, "");
  require(floor.slow_correlation_s > 0.0, section, "slow_correlation_s", "above 0");
  section.finish();
}

void read_cloud(YamlSection section, CloudOptions& cloud) {
  section.field("point_spacing_m", cloud.point_spacing_m, "");
  section.field("noise_m", cloud.noise_m, "");
  section.field("viewpoint_spacing_m", cloud.viewpoint_spacing_m, "");
  section.field("viewpoint_height_m", cloud.viewpoint_height_m, "");
  section.field("viewpoint_range_m", cloud.viewpoint_range_m, "");
  require(cloud.point_spacing_m > 0.0, section, "point_spacing_m", "above 0");
  require(cloud.viewpoint_spacing_m > 0.0, section, "viewpoint_spacing_m", "above 0");
  section.finish();
}

void read_survey(YamlSection section, SurveyOptions& survey) {
  section.field("lateral_offsets_m", survey.lateral_offsets_m, "");
  section.field("speed_m_s", survey.speed_m_s, "");
  section.field("overrun_m", survey.overrun_m, "");
  section.field("position_sigma_m", survey.position_sigma_m, "");
  section.field("angle_sigma_deg", survey.angle_sigma_deg, "");
  require(!survey.lateral_offsets_m.empty(), section, "lateral_offsets_m", "a list of at least one lane");
  require(survey.speed_m_s > 0.0, section, "speed_m_s", "above 0");
  section.finish();
}

Sequence read_sequence(YamlSection section, const std::vector<Solid>& solids) {
  Sequence sequence;
  const Solid* tube = nullptr;
  if (section.has("along")) {
    const std::string name = section.text("along", "");
    for (const Solid& solid : solids)
      if (solid.name == name && solid.shape == Solid::Shape::tube) tube = &solid;
    if (tube == nullptr) section.fail("along", "there is no tube called '" + name + "' among the solids");
  }
  const YAML::Node waypoints = required_list(section, "waypoints_m");
  for (const YAML::Node& node : waypoints) {
    const auto point = section.as<std::vector<double>>(node, "waypoints_m");
    if (point.size() != 2) section.fail("waypoints_m", "each way-point is [x, y] ([distance, left] along a tube)");
    Vector3 position(point[0], point[1], 0.0);
    if (tube != nullptr) position = tube->placement * tube_point(*tube, position);
    sequence.waypoints.emplace_back(position.head<2>());
  }
  require(sequence.waypoints.size() >= 2, section, "waypoints_m", "at least two points");
  const YAML::Node speeds = required_list(section, "speed");
  for (const YAML::Node& node : speeds) {
    const auto pair = section.as<std::vector<double>>(node, "speed");
    if (pair.size() != 2 || pair[1] <= 0.0) section.fail("speed", "each entry is [distance_m, speed_m_s], speed above 0");
    sequence.speed.push_back({pair[0], pair[1]});
  }
  require(!sequence.speed.empty(), section, "speed", "a list of at least one [distance_m, speed_m_s]");
  section.field("corner_radius_m", sequence.corner_radius_m, "");
  section.field("acceleration_m_s2", sequence.acceleration_m_s2, "");
  section.field("max_yaw_rate_rad_s", sequence.max_yaw_rate_rad_s, "");
  section.field("rest_s", sequence.rest_s, "");
  require(sequence.acceleration_m_s2 > 0.0, section, "acceleration_m_s2", "above 0");
  require(sequence.max_yaw_rate_rad_s > 0.0, section, "max_yaw_rate_rad_s", "above 0");
  section.finish();
  return sequence;
}

/// Puts `value` at `path` below `node`. A number indexes a list that is there.
void apply_override(YAML::Node node, const std::string& path, const std::string& value, const std::string& where) {
  const auto dot = path.find('.');
  const std::string key = path.substr(0, dot);
  const bool is_list = node.IsSequence();
  std::size_t index = 0;
  if (is_list) {
    const bool is_number = !key.empty() && key.find_first_not_of("0123456789") == std::string::npos && key.size() < 7;
    if (is_number) index = std::stoul(key);
    if (!is_number || index >= node.size())
      throw InputError(fmt::format("{}: --set {}: '{}' is no index of a list of {}", where, path, key, node.size()));
  }
  if (dot == std::string::npos) {
    (is_list ? node[index] : node[key]) = YAML::Load(value);
  } else {
    if (!is_list && !node[key].IsDefined()) node[key] = YAML::Node(YAML::NodeType::Map);
    YAML::Node child = is_list ? node[index] : node[key];
    if (!child.IsMap() && !child.IsSequence())
      throw InputError(fmt::format("{}: --set {}: '{}' is a value, it has no keys below it", where, path, key));
    apply_override(child, path.substr(dot + 1), value, where);
  }
}

}  // namespace

World load_world(const std::string& path, const std::vector<std::string>& overrides) {
  YAML::Node root;
  try {
    root = YAML::LoadFile(path);
  } catch (const YAML::BadFile&) {
    throw InputError(path + ": cannot open this world file");
  } catch (const YAML::ParserException& error) {
    throw InputError(fmt::format("{}: line {}: not valid YAML: {}", path, error.mark.line + 1, error.msg));
  }
  if (!root.IsMap()) throw InputError(path + ": expected a world (a map of keys: solids, sensors, sequences, …)");
  for (const std::string& setting : overrides) {
    const auto equals = setting.find('=');
    if (equals == std::string::npos || equals == 0)
      throw InputError(fmt::format("--set {}: expected key.path=value", setting));
    try {
      apply_override(root, setting.substr(0, equals), setting.substr(equals + 1), path);
    } catch (const YAML::Exception& error) {
      throw InputError(fmt::format("--set {}: not valid YAML: {}", setting, error.msg));
    }
  }

  YamlSection section(root, path);
  World world;
  world.file = path;
  world.name = section.text("name", "");
  section.field("steel_seed", world.steel_seed, "");
  section.field("start_time_ns", world.start_time_ns, "");
  section.field("gravity_m_s2", world.gravity_m_s2, "");
  section.field("earth_field_ut", world.earth_field_ut, "");
  read_sensors(section.section("sensors"), world);
  read_floor(section.section("floor"), world.floor);
  read_cloud(section.section("cloud"), world.cloud);
  read_survey(section.section("survey"), world.survey);

  Templates templates;
  if (section.has("templates")) {
    for (const auto& entry : section.required("templates")) templates[entry.first.as<std::string>()] = entry.second;
  }
  world.solids = read_solids(required_list(section, "solids"), section.name_of("solids"), templates, 0);

  YAML::Node sequences = section.required("sequences");
  if (!sequences.IsMap() || sequences.size() == 0) section.fail("sequences", "expected a map of at least one sequence");
  for (const auto& entry : sequences) {
    const auto name = entry.first.as<std::string>();
    world.sequences[name] =
        read_sequence(YamlSection(entry.second, section.name_of("sequences") + "." + name), world.solids);
  }
  section.finish();
  return world;
}

}  // namespace lodestone::simulation

#include "frontends/configuration/platform.h"

#include <Eigen/LU>
#include <cmath>
#include <sstream>

#include "core/measurements.h"
#include "frontends/configuration/file_kind.h"
#include "frontends/configuration/options.h"
#include "frontends/configuration/platform_calibration.h"
#include "frontends/configuration/platform_values.h"
#include "frontends/configuration/text_file.h"

namespace lodestone {
namespace {

using platform_values::read_clock_offset;
using platform_values::read_if_there;
using platform_values::read_pose;
using platform_values::read_positive;
using platform_values::read_topic;
using platform_values::read_value;
using platform_values::write_value;

/// Keys common to the first LiDAR and further ones.
const std::vector<std::string> lidar_keys{
    "topic",         "stamp",       "fields",        "point_times",   "time_unit",           "time_zero",
    "min_range_m",   "max_range_m", "scan_period_s", "range_noise_m", "direction_noise_rad", "T_imu_lidar",
    "clock_offset_s"};

/// Deskewed scans have no point times, so keys that describe point times are errors.
void refuse_times_of_points(const ConfigurationNode& node) {
  const auto refuse = [](const ConfigurationNode* key) {
    if (key != nullptr) key->fail("point_times: none ignores point times; remove this key, or point_times");
  };
  if (const ConfigurationNode* fields = node.find("fields")) refuse(fields->find("time"));
  refuse(node.find("time_unit"));
  refuse(node.find("time_zero"));
}

void read_lidar(const ConfigurationNode& node, LidarMessageLayout& layout, LidarModel& model) {
  read_topic(node, layout.topic);
  layout.intensity_field.clear();
  layout.ring_field.clear();
  layout.time_field.clear();
  if (const ConfigurationNode* fields = node.find("fields")) {
    fields->refuse_keys_other_than({"intensity", "ring", "time"});
    read_if_there(*fields, "intensity", layout.intensity_field);
    read_if_there(*fields, "ring", layout.ring_field);
    read_if_there(*fields, "time", layout.time_field);
  }
  read_if_there(node, "stamp", layout.stamp);
  read_if_there(node, "time_unit", layout.time_unit);
  read_if_there(node, "time_zero", layout.time_zero);
  read_if_there(node, "point_times", layout.point_times);
  if (layout.point_times == PointTimes::none) refuse_times_of_points(node);
  read_clock_offset(node, "clock_offset_s", layout.clock_offset_s);
  read_value(node.at("min_range_m"), model.min_range_m);
  if (!(model.min_range_m >= 0.0)) node.at("min_range_m").fail("expected a number of at least 0");
  read_positive(node, "max_range_m", model.max_range_m);
  if (model.max_range_m <= model.min_range_m) node.at("max_range_m").fail("expected more than min_range_m");
  read_positive(node, "scan_period_s", model.scan_period_s);
  read_if_there(node, "direction_noise_rad", model.direction_noise_rad);
  if (!(model.direction_noise_rad >= 0.0)) node.at("direction_noise_rad").fail("expected a number of at least 0");
  model.T_imu_lidar = read_pose(node.at("T_imu_lidar"));
}

void read_first_lidar(const ConfigurationNode& node, Platform& platform) {
  std::vector<std::string> keys = lidar_keys;
  keys.push_back("calibration");
  node.refuse_keys_other_than(keys);
  read_positive(node, "range_noise_m", platform.suite.lidar.range_noise_m);
  read_lidar(node, platform.lidar, platform.suite.lidar);
  read_calibration_sigmas(node, "calibration", platform.suite.calibration.lidar);
}

/// A further LiDAR has the model of the first one, unless the file states otherwise.
void read_further_lidar(const ConfigurationNode& node, Platform& platform) {
  node.refuse_keys_other_than(lidar_keys);
  if (1 + platform.further_lidars.size() == kMostLidars) {
    node.fail("expected at most " + std::to_string(kMostLidars - 1) + " further LiDARs");
  }
  LidarModel& model = platform.suite.further_lidars.emplace_back();
  model.range_noise_m = platform.suite.lidar.range_noise_m;
  model.direction_noise_rad = platform.suite.lidar.direction_noise_rad;
  if (node.has("range_noise_m")) read_positive(node, "range_noise_m", model.range_noise_m);
  read_lidar(node, platform.further_lidars.emplace_back(), model);
}

void read_imu(const ConfigurationNode& node, Platform& platform) {
  node.refuse_keys_other_than({"topic", "angular_velocity", "linear_acceleration", "acceleration_unit", "rate_hz",
                               "gyroscope_noise_density_rad_s_sqrt_hz", "accelerometer_noise_density_m_s2_sqrt_hz",
                               "gyroscope_bias_random_walk_rad_s2_sqrt_hz",
                               "accelerometer_bias_random_walk_m_s3_sqrt_hz", "calibration"});
  ImuNoise& noise = platform.suite.imu;
  read_topic(node, platform.imu.topic);
  read_if_there(node, "acceleration_unit", platform.imu.acceleration_unit);
  if (node.has("angular_velocity") || node.has("linear_acceleration")) {
    read_value(node.at("angular_velocity"), platform.imu.angular_velocity_path);
    read_value(node.at("linear_acceleration"), platform.imu.linear_acceleration_path);
  }
  read_positive(node, "rate_hz", noise.rate_hz);
  read_positive(node, "gyroscope_noise_density_rad_s_sqrt_hz", noise.gyroscope_noise_density);
  read_positive(node, "accelerometer_noise_density_m_s2_sqrt_hz", noise.accelerometer_noise_density);
  read_positive(node, "gyroscope_bias_random_walk_rad_s2_sqrt_hz", noise.gyroscope_bias_random_walk);
  read_positive(node, "accelerometer_bias_random_walk_m_s3_sqrt_hz", noise.accelerometer_bias_random_walk);
  read_calibration_sigmas(node, "calibration", platform.suite.calibration.imu);
}

void read_calibration(const ConfigurationNode& node, MagnetometerMessageLayout& layout) {
  if (const ConfigurationNode* offset = node.find("hard_iron_ut")) {
    layout.hard_iron_ut = Vector3(offset->as_doubles(3).data());
    if (!layout.hard_iron_ut.allFinite()) offset->fail("expected finite numbers");
  }
  if (const ConfigurationNode* matrix = node.find("soft_iron_correction")) {
    layout.soft_iron_correction =
        Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(matrix->as_doubles(9).data());
    const double determinant = layout.soft_iron_correction.determinant();
    if (!(determinant > 0.0) || std::isinf(determinant)) {
      matrix->fail("expected nine numbers, row by row, of a matrix with a determinant above 0");
    }
  }
}

void read_magnetometer(const ConfigurationNode& node, Platform& platform) {
  node.refuse_keys_other_than(
      {"name", "topic", "values", "unit", "noise_ut", "T_imu_mag", "hard_iron_ut", "soft_iron_correction"});
  MagnetometerModel& model = platform.suite.magnetometers.emplace_back();
  read_value(node.at("name"), model.name);
  for (const MagnetometerModel& other : platform.suite.magnetometers) {
    if (&other != &model && other.name == model.name)
      node.at("name").fail("another magnetometer already has the name " + model.name);
  }
  MagnetometerMessageLayout layout;
  read_topic(node, layout.topic);
  read_if_there(node, "values", layout.path);
  for (const MagnetometerMessageLayout& other : platform.magnetometers) {
    if (other.topic == layout.topic && other.path == layout.path) {
      node.at("topic").fail("another magnetometer already has the topic " + layout.topic +
                            (layout.path.empty() ? "; if one message contains several, set 'values' for each"
                                                 : ", with the same values"));
    }
  }
  read_if_there(node, "unit", layout.unit);
  read_calibration(node, layout);
  platform.magnetometers.push_back(layout);
  read_positive(node, "noise_ut", model.noise_ut);
  model.T_imu_mag = read_pose(node.at("T_imu_mag"));
}

/// The keys of a wheel on each side.
void read_sides(const ConfigurationNode& node, WheelMessageLayout& layout) {
  const auto has = [&](const std::string& ending) { return node.has("left" + ending) || node.has("right" + ending); };
  if (!has("_velocity") && !has("_position")) {
    if (node.has("track_m")) node.at("track_m").fail("is used only with left_position or left_velocity");
    return;
  }
  layout.positions = has("_position");
  const std::string ending = layout.positions ? "_position" : "_velocity";
  for (const char* other : {"left_velocity", "right_velocity", "linear_velocity", "angular_velocity"}) {
    const bool own = !layout.positions && std::string(other).ends_with("t_velocity");
    if (node.has(other) && !own) node.at(other).fail("cannot be used beside left" + ending + "; remove one of them");
  }
  read_value(node.at("left" + ending), layout.left_path);
  read_value(node.at("right" + ending), layout.right_path);
  read_positive(node, "track_m", layout.track_m);
}

void read_wheels(const ConfigurationNode& node, Platform& platform) {
  node.refuse_keys_other_than({"topic", "linear_velocity", "angular_velocity", "left_velocity", "right_velocity",
                               "left_position", "right_position", "track_m", "scale", "clock_offset_s",
                               "velocity_sigma_m_s", "lateral_motion", "lateral_sigma_m_s", "T_imu_wheels",
                               "calibration"});
  WheelMessageLayout& layout = platform.wheels;
  WheelModel& model = platform.suite.wheels.emplace();
  read_topic(node, layout.topic);
  if (node.has("linear_velocity") || node.has("angular_velocity")) {
    read_value(node.at("linear_velocity"), layout.linear_velocity_path);
    read_value(node.at("angular_velocity"), layout.angular_velocity_path);
  }
  read_sides(node, layout);
  if (node.has("scale")) read_positive(node, "scale", layout.scale);
  read_clock_offset(node, "clock_offset_s", layout.clock_offset_s);
  read_positive(node, "velocity_sigma_m_s", model.velocity_sigma_m_s);
  read_if_there(node, "lateral_motion", model.lateral_motion);
  if (model.lateral_motion == LateralMotion::measured && !layout.left_path.empty()) {
    node.at("lateral_motion").fail("'measured' requires a lateral velocity, which a wheel on each side does not give");
  }
  if (node.has("lateral_sigma_m_s")) {
    if (model.lateral_motion != LateralMotion::none) {
      node.at("lateral_sigma_m_s").fail("is used only with lateral_motion: none; set that, or remove this key");
    }
    read_positive(node, "lateral_sigma_m_s", model.lateral_sigma_m_s);
  }
  model.T_imu_wheels = read_pose(node.at("T_imu_wheels"));
  read_calibration_sigmas(node, "calibration", platform.suite.calibration.wheels);
}

/// From the Moon's to that of the largest planet; other values have another unit.
void read_gravity(const ConfigurationNode& node, double& gravity_m_s2) {
  read_value(node, gravity_m_s2);
  if (!(gravity_m_s2 >= 1.5 && gravity_m_s2 <= 25.0)) node.fail("expected 1.5 to 25 m/s2; on earth, about 9.81");
}

Platform read_platform(const ConfigurationNode& root, const SensorChoice& required) {
  root.refuse_keys_other_than({"name", "gravity_m_s2", "lidar", "further_lidars", "imu", "magnetometer_clock_offset_s",
                               "magnetometer_calibration", "magnetometers", "wheels", "guesses"});
  Platform platform;
  platform.file = root.file();
  read_value(root.at("name"), platform.name);
  if (required.lidar || root.has("lidar") || root.has("further_lidars")) {
    read_first_lidar(root.at("lidar"), platform);
  } else {
    platform.lidar.topic.clear();
  }
  if (const ConfigurationNode* further = root.find("further_lidars")) {
    for (const ConfigurationNode& node : further->elements()) read_further_lidar(node, platform);
  }
  if (required.imu || root.find("imu") != nullptr) read_imu(root.at("imu"), platform);
  if (required.imu || root.has("gravity_m_s2")) read_gravity(root.at("gravity_m_s2"), platform.suite.gravity_m_s2);
  read_clock_offset(root, "magnetometer_clock_offset_s", platform.magnetometer_clock_offset_s);
  read_calibration_sigmas(root, "magnetometer_calibration", platform.suite.calibration.magnetometers);
  if (const ConfigurationNode* magnetometers = root.find("magnetometers")) {
    for (const ConfigurationNode& node : magnetometers->elements()) read_magnetometer(node, platform);
  }
  if (const ConfigurationNode* wheels = root.find("wheels")) read_wheels(*wheels, platform);
  if (const ConfigurationNode* guesses = root.find("guesses")) {
    for (const ConfigurationNode& node : guesses->elements()) read_value(node, platform.guesses.emplace_back());
  }
  return platform;
}

template <class Value>
std::string line(int depth, const std::string& key, const Value& value) {
  return std::string(static_cast<std::size_t>(2 * depth), ' ') + key + ": " + write_value(value) + "\n";
}

std::string pose_lines(int depth, const std::string& key, const Pose& pose) {
  const Vector3& p = pose.position;
  const Quaternion& q = pose.rotation;
  return std::string(static_cast<std::size_t>(2 * depth), ' ') + key + ":\n" +
         line(depth + 1, "translation_m", std::vector<double>{p.x(), p.y(), p.z()}) +
         line(depth + 1, "quaternion_xyzw", std::vector<double>{q.x(), q.y(), q.z(), q.w()});
}

std::string lidar_lines(int depth, const LidarMessageLayout& layout, const LidarModel& model) {
  std::string text;
  if (layout.stamp) text += line(depth, "stamp", *layout.stamp);
  std::string fields;
  if (!layout.intensity_field.empty()) fields += line(depth + 1, "intensity", layout.intensity_field);
  if (!layout.ring_field.empty()) fields += line(depth + 1, "ring", layout.ring_field);
  if (!layout.time_field.empty()) fields += line(depth + 1, "time", layout.time_field);
  if (!fields.empty()) text += std::string(static_cast<std::size_t>(2 * depth), ' ') + "fields:\n" + fields;
  if (layout.time_unit) text += line(depth, "time_unit", *layout.time_unit);
  if (layout.time_zero) text += line(depth, "time_zero", *layout.time_zero);
  if (layout.point_times != PointTimes::field) text += line(depth, "point_times", layout.point_times);
  if (layout.clock_offset_s != 0.0) text += line(depth, "clock_offset_s", layout.clock_offset_s);
  return text + line(depth, "range_noise_m", model.range_noise_m) +
         line(depth, "direction_noise_rad", model.direction_noise_rad) + line(depth, "min_range_m", model.min_range_m) +
         line(depth, "max_range_m", model.max_range_m) + line(depth, "scan_period_s", model.scan_period_s) +
         pose_lines(depth, "T_imu_lidar", model.T_imu_lidar);
}

/// Empty for a magnetometer without calibration.
std::string calibration_lines(int depth, const MagnetometerMessageLayout& layout) {
  if (!layout.calibrated()) return {};
  const Vector3& b = layout.hard_iron_ut;
  const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> C = layout.soft_iron_correction;
  return line(depth, "hard_iron_ut", std::vector<double>{b.x(), b.y(), b.z()}) +
         line(depth, "soft_iron_correction", std::vector<double>(C.data(), C.data() + 9));
}

/// Empty for a platform without wheels.
std::string wheel_lines(const Platform& platform) {
  if (!platform.suite.wheels) return {};
  const WheelMessageLayout& layout = platform.wheels;
  const WheelModel& model = *platform.suite.wheels;
  std::string text = "wheels:\n" + line(1, "topic", layout.topic);
  if (!layout.linear_velocity_path.empty()) {
    text += line(1, "linear_velocity", layout.linear_velocity_path) +
            line(1, "angular_velocity", layout.angular_velocity_path);
  }
  if (!layout.left_path.empty()) {
    const std::string ending = layout.positions ? "_position" : "_velocity";
    text += line(1, "left" + ending, layout.left_path) + line(1, "right" + ending, layout.right_path) +
            line(1, "track_m", layout.track_m);
  }
  if (layout.scale != 1.0) text += line(1, "scale", layout.scale);
  if (layout.clock_offset_s != 0.0) text += line(1, "clock_offset_s", layout.clock_offset_s);
  text += line(1, "velocity_sigma_m_s", model.velocity_sigma_m_s) + line(1, "lateral_motion", model.lateral_motion);
  if (model.lateral_motion == LateralMotion::none) text += line(1, "lateral_sigma_m_s", model.lateral_sigma_m_s);
  return text + pose_lines(1, "T_imu_wheels", model.T_imu_wheels) +
         calibration_sigma_lines(1, "calibration", platform.suite.calibration.wheels);
}

/// Empty without guesses.
std::string guess_lines(const Platform& platform) {
  if (platform.guesses.empty()) return {};
  std::string text = "guesses:\n";
  for (const std::string& key : platform.guesses) text += "  - " + write_value(key) + "\n";
  return text;
}

std::string format_platform(const Platform& platform) {
  const ImuNoise& imu = platform.suite.imu;
  std::string text = line(0, "name", platform.name) + line(0, "gravity_m_s2", platform.suite.gravity_m_s2);
  if (platform.has_lidar()) {
    text += "lidar:\n" + line(1, "topic", platform.lidar.topic) + lidar_lines(1, platform.lidar, platform.suite.lidar) +
            calibration_sigma_lines(1, "calibration", platform.suite.calibration.lidar);
  }
  if (!platform.further_lidars.empty()) text += "further_lidars:\n";
  for (std::size_t i = 0; i < platform.further_lidars.size(); ++i) {
    const LidarMessageLayout& layout = platform.further_lidars[i];
    text +=
        "  - topic: " + write_value(layout.topic) + "\n" + lidar_lines(2, layout, platform.suite.further_lidars.at(i));
  }
  text += "imu:\n" + line(1, "topic", platform.imu.topic) +
          (platform.imu.angular_velocity_path.empty()
               ? ""
               : line(1, "angular_velocity", platform.imu.angular_velocity_path) +
                     line(1, "linear_acceleration", platform.imu.linear_acceleration_path)) +
          line(1, "acceleration_unit", platform.imu.acceleration_unit) + line(1, "rate_hz", imu.rate_hz) +
          line(1, "gyroscope_noise_density_rad_s_sqrt_hz", imu.gyroscope_noise_density) +
          line(1, "accelerometer_noise_density_m_s2_sqrt_hz", imu.accelerometer_noise_density) +
          line(1, "gyroscope_bias_random_walk_rad_s2_sqrt_hz", imu.gyroscope_bias_random_walk) +
          line(1, "accelerometer_bias_random_walk_m_s3_sqrt_hz", imu.accelerometer_bias_random_walk) +
          calibration_sigma_lines(1, "calibration", platform.suite.calibration.imu) +
          (platform.magnetometer_clock_offset_s == 0.0
               ? ""
               : line(0, "magnetometer_clock_offset_s", platform.magnetometer_clock_offset_s)) +
          calibration_sigma_lines(0, "magnetometer_calibration", platform.suite.calibration.magnetometers) +
          wheel_lines(platform) + guess_lines(platform);
  if (platform.suite.magnetometers.empty()) return text + "magnetometers: []\n";
  text += "magnetometers:\n";
  for (std::size_t i = 0; i < platform.suite.magnetometers.size(); ++i) {
    const MagnetometerModel& magnetometer = platform.suite.magnetometers[i];
    const MagnetometerMessageLayout& layout = platform.magnetometers.at(i);
    text += "  - name: " + write_value(magnetometer.name) + "\n" + line(2, "topic", layout.topic) +
            (layout.path.empty() ? "" : line(2, "values", layout.path)) + line(2, "unit", layout.unit) +
            line(2, "noise_ut", magnetometer.noise_ut) + calibration_lines(2, layout) +
            pose_lines(2, "T_imu_mag", magnetometer.T_imu_mag);
  }
  return text;
}

}  // namespace

double microtesla_per(FieldUnit unit) {
  switch (unit) {
    case FieldUnit::microtesla:
      return 1.0;
    case FieldUnit::nanotesla:
      return 1e-3;
    case FieldUnit::gauss:
      return 100.0;
    case FieldUnit::milligauss:
      return 0.1;
    case FieldUnit::tesla:
      break;
  }
  return 1e6;
}

Platform load_platform(const std::string& path, const SensorChoice& required) {
  require_kind(path, SeemingKind::platform, "a platform file");
  return read_platform(ConfigurationNode::load(path), required);
}

Platform parse_platform(const std::string& text, const std::string& name, const SensorChoice& required) {
  return read_platform(ConfigurationNode::parse(text, name), required);
}

void save_platform(const Platform& platform, const std::string& path, const std::string& comment) {
  std::string text;
  std::istringstream lines(comment);
  for (std::string each; std::getline(lines, each);) text += "# " + each + "\n";
  write_text_file(path, text + format_platform(platform));
}

}  // namespace lodestone

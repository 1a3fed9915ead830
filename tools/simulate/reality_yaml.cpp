#include "tools/simulate/reality_yaml.h"

#include <sstream>

#include "frontends/configuration/options.h"
#include "frontends/configuration/yaml_text.h"

namespace lodestone::simulation {
namespace {

using options_detail::write_value;

std::string list_of(const Vector3& v) {
  return write_value(std::vector<double>{v.x(), v.y(), v.z()});
}

/// Row by row.
std::string list_of(const Matrix3& m) {
  return write_value(
      std::vector<double>{m(0, 0), m(0, 1), m(0, 2), m(1, 0), m(1, 1), m(1, 2), m(2, 0), m(2, 1), m(2, 2)});
}

std::string pose_of(const Pose& pose) {
  const Quaternion& q = pose.rotation;
  return "{translation_m: " + list_of(pose.position) +
         ", quaternion_xyzw: " + write_value(std::vector<double>{q.x(), q.y(), q.z(), q.w()}) + "}";
}

std::string list_of(const Eigen::Vector2d& v) {
  return write_value(std::vector<double>{v.x(), v.y()});
}

std::string indented(const std::string& lines) {
  std::istringstream input(lines);
  std::string text;
  for (std::string line; std::getline(input, line);) text += "  " + line + "\n";
  return text;
}

std::string sensor_lines(const World& world, const Reality& reality) {
  const LidarErrors& lidar = reality.lidar;
  const DensityFactors& densities = reality.densities;
  std::string text = "# Ground truth. T_imu_x maps points of x to imu. An offset is stamp minus true time.\n";
  text += "lidar:\n  T_imu_lidar: " + pose_of(with_error(world.lidar.T_imu_lidar(), lidar.mounting)) + "\n";
  text += "  clock_offset_s: " + write_value(lidar.clock_offset_s) + "\n";
  text += "  ring_bias_m: " + write_value(lidar.ring_bias_m) + "\n";
  text += "  bias_at_80deg_incidence_m: " + write_value(lidar.incidence_bias_m) + "\n";
  text += "# Reading = matrix (row by row) * true value, then bias and noise; imu axes.\n";
  text += "imu:\n  gyroscope_matrix: " + list_of(reality.imu.gyroscope) + "\n";
  text += "  accelerometer_matrix: " + list_of(reality.imu.accelerometer) + "\n";
  text += "  # Densities in platform.yaml, divided by the true ones.\n";
  text += "  gyroscope_noise_density_factor: " + write_value(densities.gyroscope_noise) + "\n";
  text += "  accelerometer_noise_density_factor: " + write_value(densities.accelerometer_noise) + "\n";
  text += "  gyroscope_bias_random_walk_factor: " + write_value(densities.gyroscope_bias_walk) + "\n";
  text += "  accelerometer_bias_random_walk_factor: " + write_value(densities.accelerometer_bias_walk) + "\n";
  if (world.wheels) {
    const WheelErrors& wheels = reality.wheels;
    text += "# Reported velocity = (scale + slip) * true velocity.\n";
    text += "wheels:\n  T_imu_wheels: " + pose_of(with_error(world.wheels->T_imu_wheels(), wheels.mounting)) + "\n";
    text += "  scale: " + write_value(wheels.scale) + "\n";
  }
  text += "magnetometer_clock_offset_s: " + write_value(reality.magnetometer_clock_offset_s) + "\n";
  text +=
      "# Reading = matrix (row by row) * (field + motors) + offset, then noise; sensor axes. The motors' field is a\n"
      "# vector times the commanded forward acceleration, and a vector times the commanded yaw rate.\n";
  text += reality.magnetometers.empty() ? "magnetometers: []\n" : "magnetometers:\n";
  for (std::size_t j = 0; j < reality.magnetometers.size(); ++j) {
    const MagnetometerMount& mount = world.magnetometers.mounts[j];
    const MagnetometerErrors &errors = reality.magnetometers[j], &survey = reality.survey_magnetometers[j];
    text += "  - name: " + quoted_yaml(mount.name) + "\n";
    text += "    T_imu_mag: " + pose_of(with_error(mount.T_imu_mag(), errors.mounting)) + "\n";
    text += "    matrix: " + list_of(errors.matrix) + "\n    offset_ut: " + list_of(errors.offset_ut) + "\n";
    text +=
        "    survey_matrix: " + list_of(survey.matrix) + "\n    survey_offset_ut: " + list_of(survey.offset_ut) + "\n";
    text += "    motors_ut_per_m_s2: " + list_of(errors.acceleration_field) + "\n";
    text += "    motors_ut_per_rad_s: " + list_of(errors.turning_field) + "\n";
  }
  return text;
}

std::string displacement_lines(const DisplacementField& field) {
  std::string text =
      "# Both maps show the object at x at x + d(x): d = sum of a cos(w . x) + b sin(w . x), map axes; a line is\n"
      "# w (rad/m), a (m), b (m). truth.tum has the displaced poses.\n";
  text += field.empty() ? "displacement: []\n" : "displacement:\n";
  for (const DisplacementField::Wave& wave : field.waves()) {
    std::vector<double> row(wave.wave.data(), wave.wave.data() + 3);
    row.insert(row.end(), wave.amplitude_cos.data(), wave.amplitude_cos.data() + 3);
    row.insert(row.end(), wave.amplitude_sin.data(), wave.amplitude_sin.data() + 3);
    text += "  - " + write_value(row) + "\n";
  }
  return text;
}

std::string moved_lines(const MovedObjects& moved) {
  std::string text = "# Centres and sizes along the map's axes.\n";
  text += moved.list.empty() ? "moved_objects: []\n" : "moved_objects:\n";
  for (const MovedObject& object : moved.list) {
    text += "  - {change: " + write_value(object.change) + ", name: " + quoted_yaml(object.name) +
            ", size_m: " + list_of(object.size);
    if (object.change != ObjectChange::added) text += ", mapped_at_m: " + list_of(object.mapped_at);
    if (object.change != ObjectChange::gone) text += ", driven_at_m: " + list_of(object.driven_at);
    text += "}\n";
  }
  return text;
}

std::string mover_lines(const Movers& movers) {
  std::string text = "# To and fro between two places; seconds since the log's begin.\n";
  text += movers.list().empty() ? "movers: []\n" : "movers:\n";
  for (const Mover& mover : movers.list()) {
    text += std::string("  - {kind: ") + (mover.is_vehicle ? "vehicle" : "person") +
            ", from_m: " + list_of(mover.from) + ", to_m: " + list_of(mover.to) +
            ", speed_m_s: " + write_value(mover.speed_m_s) + ", begin_s: " + write_value(mover.begin_s) +
            ", end_s: " + write_value(mover.end_s) + ", meeting_s: " + write_value(mover.meeting_s) +
            ", meeting_m: " + write_value(mover.meeting_m) + "}\n";
  }
  return text;
}

}  // namespace

std::string reality_yaml(const World& world, const MovedObjects& moved, const SimulationSource& drive) {
  const Reality& reality = drive.reality();
  std::string text =
      "# True values that the user of this log does not know (config/worlds/README.md, section Reality).\n";
  text += "seed: " + std::to_string(reality.seed) + "\nreality:\n" + indented(save_options(reality.options));
  text += sensor_lines(world, reality);
  text += displacement_lines(reality.displacement) + moved_lines(moved) + mover_lines(drive.movers());
  // The error of each scan's stamp: offset and jitter.
  const bool jitters = reality.lidar.stamp_jitter_sigma_s > 0.0;
  text += "scan_stamp_errors_s: " + write_value(jitters ? drive.scan_stamp_errors() : std::vector<double>{}) + "\n";
  return text;
}

}  // namespace lodestone::simulation

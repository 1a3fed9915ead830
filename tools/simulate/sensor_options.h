#pragma once

#include <string>
#include <vector>

#include "core/geometry/pose.h"
#include "core/options.h"

/// Sensors of the robot, and disturbances by the floor. load_options reads every struct: names contain the units.
namespace lodestone::simulation {

/// R = Rz(yaw) Ry(pitch) Rx(roll), degrees, and a position in metres.
Pose mounting_pose(const std::vector<double>& position_m, const std::vector<double>& rotation_rpy_deg);

/// Motion of a LiDAR's beams; see BeamPattern.
enum class LidarPattern { rotating, rosette };

constexpr auto enum_names(LidarPattern) {
  return EnumNames<LidarPattern, 2>{{{LidarPattern::rotating, "rotating"}, {LidarPattern::rosette, "rosette"}}};
}

/// Message type of scans: PointCloud2 (with the fields of Ouster for a rotating LiDAR, of Livox for a rosette), or
/// Livox' own CustomMsg.
enum class LidarMessage { pointcloud2, livox_custom };

constexpr auto enum_names(LidarMessage) {
  return EnumNames<LidarMessage, 2>{
      {{LidarMessage::pointcloud2, "pointcloud2"}, {LidarMessage::livox_custom, "livox_custom"}}};
}

struct LidarOptions {
  LidarPattern pattern = LidarPattern::rotating;
  LidarMessage message = LidarMessage::pointcloud2;
  int rows = 32;
  int columns = 1024;
  double vertical_field_of_view_deg = 45.0;
  double points_per_second = 200000.0;
  double lowest_elevation_deg = -7.0;
  double highest_elevation_deg = 52.0;
  double rate_hz = 10.0;
  double first_scan_s = 0.05;
  double min_range_m = 0.5;
  double max_range_m = 100.0;
  double range_noise_m = 0.02;
  double direction_noise_rad = 3e-4;
  double max_incidence_deg = 88.0;
  double dropout_probability = 0.01;
  std::vector<double> position_m{0.0, 0.0, 0.3};
  std::vector<double> rotation_rpy_deg{0.0, 0.0, 0.0};

  Pose T_imu_lidar() const { return mounting_pose(position_m, rotation_rpy_deg); }
  void check() const;
  template <class Visitor>
  void visit(Visitor& visitor) {
    visitor.field("pattern", pattern, "rotating (rows and columns) or rosette (a Livox Mid-360, no scan repeats)");
    visitor.field("message", message,
                  "message type of the scans: pointcloud2, or livox_custom (livox_ros_driver2/CustomMsg)");
    visitor.field("rows", rows, "rotating: beams, evenly spread over the vertical field of view");
    visitor.field("columns", columns, "rotating: firings a revolution");
    visitor.field("vertical_field_of_view_deg", vertical_field_of_view_deg,
                  "rotating: from the lowest to the uppermost beam, about the level");
    visitor.field("points_per_second", points_per_second, "rosette: beams a second, four at a time");
    visitor.field("lowest_elevation_deg", lowest_elevation_deg, "rosette: lower end of the field of view");
    visitor.field("highest_elevation_deg", highest_elevation_deg, "rosette: upper end of the field of view");
    visitor.field("rate_hz", rate_hz, "scans a second; rotating: revolutions");
    visitor.field("first_scan_s", first_scan_s, "start of the first scan after the first IMU sample");
    visitor.field("min_range_m", min_range_m, "nearer returns are discarded");
    visitor.field("max_range_m", max_range_m, "farther surfaces give no return");
    visitor.field("range_noise_m", range_noise_m, "one sigma along the beam");
    visitor.field("direction_noise_rad", direction_noise_rad,
                  "one sigma of a beam's true direction against its stated direction");
    visitor.field("max_incidence_deg", max_incidence_deg, "a beam with a larger angle of incidence gives no return");
    visitor.field("dropout_probability", dropout_probability, "probability that any other return is lost");
    visitor.field("position_m", position_m, "of the lidar in imu axes");
    visitor.field("rotation_rpy_deg", rotation_rpy_deg, "roll, pitch, yaw of the lidar against the imu");
  }
};

struct ImuOptions {
  double rate_hz = 200.0;
  double height_m = 0.2;
  double gyroscope_noise_density_rad_s_sqrt_hz = 1.0e-3;
  double accelerometer_noise_density_m_s2_sqrt_hz = 2.0e-2;
  double gyroscope_bias_random_walk_rad_s2_sqrt_hz = 2.0e-5;
  double accelerometer_bias_random_walk_m_s3_sqrt_hz = 2.0e-4;
  double gyroscope_bias_sigma_rad_s = 5.0e-3;
  double accelerometer_bias_sigma_m_s2 = 5.0e-2;

  void check() const;
  template <class Visitor>
  void visit(Visitor& visitor) {
    visitor.field("rate_hz", rate_hz, "samples a second");
    visitor.field("height_m", height_m, "of the imu above the floor");
    visitor.field("gyroscope_noise_density_rad_s_sqrt_hz", gyroscope_noise_density_rad_s_sqrt_hz, "white noise");
    visitor.field("accelerometer_noise_density_m_s2_sqrt_hz", accelerometer_noise_density_m_s2_sqrt_hz, "white noise");
    visitor.field("gyroscope_bias_random_walk_rad_s2_sqrt_hz", gyroscope_bias_random_walk_rad_s2_sqrt_hz,
                  "random walk of the bias");
    visitor.field("accelerometer_bias_random_walk_m_s3_sqrt_hz", accelerometer_bias_random_walk_m_s3_sqrt_hz,
                  "random walk of the bias");
    visitor.field("gyroscope_bias_sigma_rad_s", gyroscope_bias_sigma_rad_s, "one sigma of the bias at the start");
    visitor.field("accelerometer_bias_sigma_m_s2", accelerometer_bias_sigma_m_s2, "one sigma of the bias at the start");
  }
};

struct MagnetometerMount {
  std::string name;
  std::vector<double> position_m{0.0, 0.0, 0.0};
  std::vector<double> rotation_rpy_deg{0.0, 0.0, 0.0};

  Pose T_imu_mag() const { return mounting_pose(position_m, rotation_rpy_deg); }
  void check() const;
  template <class Visitor>
  void visit(Visitor& visitor) {
    visitor.field("name", name, "name in the platform file");
    visitor.field("position_m", position_m, "in imu axes");
    visitor.field("rotation_rpy_deg", rotation_rpy_deg, "roll, pitch, yaw against the imu");
  }
};

struct MagnetometerOptions {
  double rate_hz = 200.0;
  double offset_s = 1.3e-3;
  double noise_ut = 1.0;
  std::vector<MagnetometerMount> mounts;  ///< read separately: a list

  void check() const;
  template <class Visitor>
  void visit(Visitor& visitor) {
    visitor.field("rate_hz", rate_hz, "samples a second, all magnetometers at one instant");
    visitor.field("offset_s", offset_s, "of the first sample after the first IMU sample");
    visitor.field("noise_ut", noise_ut, "white, one sigma a component");
  }
};

/// Wheel odometry. A robot has it if its world has the section sensors.wheels.
struct WheelOptions {
  double rate_hz = 20.0;
  double velocity_noise_m_s = 0.02;
  std::vector<double> position_m{0.0, 0.0, -0.2};
  std::vector<double> rotation_rpy_deg{0.0, 0.0, 0.0};

  Pose T_imu_wheels() const { return mounting_pose(position_m, rotation_rpy_deg); }
  void check() const;
  template <class Visitor>
  void visit(Visitor& visitor) {
    visitor.field("rate_hz", rate_hz, "samples a second");
    visitor.field("velocity_noise_m_s", velocity_noise_m_s, "white, one sigma of the forward velocity");
    visitor.field("position_m", position_m, "of the wheel frame in imu axes; 0.2 m below the imu is the floor");
    visitor.field("rotation_rpy_deg", rotation_rpy_deg, "roll, pitch, yaw of the wheel frame against the imu");
  }
};

struct FloorOptions {
  double height_sigma_m = 1.0e-3;
  double tilt_sigma_deg = 0.25;
  double slip_yaw_sigma_deg = 0.6;
  double slip_position_sigma_m = 0.01;
  double slow_correlation_s = 0.5;
  double vibration_m = 5.0e-5;
  double vibration_tilt_deg = 0.015;

  void check() const;
  template <class Visitor>
  void visit(Visitor& visitor) {
    visitor.field("height_sigma_m", height_sigma_m, "unevenness, one sigma");
    visitor.field("tilt_sigma_deg", tilt_sigma_deg, "of roll and pitch, one sigma");
    visitor.field("slip_yaw_sigma_deg", slip_yaw_sigma_deg,
                  "heading of a skid-steer robot against its path, one sigma");
    visitor.field("slip_position_sigma_m", slip_position_sigma_m,
                  "wheel slip: deviation from the plan in x and y, one sigma");
    visitor.field("slow_correlation_s", slow_correlation_s, "correlation time of the four above");
    visitor.field("vibration_m", vibration_m, "in x, y and z, up to about 15 Hz, one sigma at speed");
    visitor.field("vibration_tilt_deg", vibration_tilt_deg, "of roll and pitch, up to about 15 Hz, one sigma at speed");
  }
};

struct SurveyOptions {
  std::vector<double> lateral_offsets_m{-0.6, -0.2, 0.2, 0.6};
  double speed_m_s = 1.8;
  double overrun_m = 1.5;
  double position_sigma_m = 2.0e-3;
  double angle_sigma_deg = 0.02;

  void check() const;
  template <class Visitor>
  void visit(Visitor& visitor) {
    visitor.field("lateral_offsets_m", lateral_offsets_m, "one lane each, left of the sequence's path");
    visitor.field("speed_m_s", speed_m_s, "of the survey drive");
    visitor.field("overrun_m", overrun_m, "past both ends of the path");
    visitor.field("position_sigma_m", position_sigma_m, "white noise of the survey's trajectory, a component");
    visitor.field("angle_sigma_deg", angle_sigma_deg, "white noise of the survey's trajectory, a component");
  }
};

struct CloudOptions {
  double point_spacing_m = 0.09;
  double noise_m = 0.01;
  double viewpoint_spacing_m = 3.0;
  double viewpoint_height_m = 1.5;
  double viewpoint_range_m = 125.0;
  std::string scene;

  void check() const;
  template <class Visitor>
  void visit(Visitor& visitor) {
    visitor.field("point_spacing_m", point_spacing_m, "one point per spacing squared of surface");
    visitor.field("noise_m", noise_m, "of the surveyed points, one sigma a component");
    visitor.field("viewpoint_spacing_m", viewpoint_spacing_m,
                  "distance of the scanner's viewpoints along every sequence's path");
    visitor.field("viewpoint_height_m", viewpoint_height_m,
                  "the scanner stands at the lidar's height and at this height");
    visitor.field("viewpoint_range_m", viewpoint_range_m, "range of the scanner");
    visitor.field("scene", scene, "scene that is surveyed; empty: the permanent solids alone");
  }
};

}  // namespace lodestone::simulation

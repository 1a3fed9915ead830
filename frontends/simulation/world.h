#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "core/geometry/pose.h"
#include "core/sensor_suite.h"

/// Worlds and the sensors that drive through them: what `lodestone simulate` writes, also as a MeasurementSource.
namespace lodestone::simulation {

/// Steel of a solid, in the solid's own frame (of a tube: distance along its axis, left of it, above its floor).
struct Steel {
  enum class Kind {
    dipole,   ///< one dipole at region_min
    bar,      ///< one bar from region_min to region_max
    dipoles,  ///< scattered in the region
    rods,     ///< horizontal bars scattered in the region
    rings,    ///< hoops of bars round a tube, every spacing_m, at ring_radius_m about the tube's centre line
  };
  Kind kind = Kind::dipole;
  Vector3 region_min = Vector3::Zero();  ///< m
  Vector3 region_max = Vector3::Zero();  ///< m
  double density_per_m2 = 0.0;           ///< of the region seen from above
  std::array<double, 2> length_m{1.0, 1.0};  ///< of rods, uniform in this range
  double angle_deg = 0.0;                ///< of rods against the solid's x axis
  double angle_spread_deg = 90.0;        ///< of rods: uniform within plus and minus this of angle_deg
  double spacing_m = 1.0;                ///< of rings
  double ring_radius_m = 0.0;
  int ring_segments = 12;
  Vector3 moment = Vector3::Zero();      ///< A·m²; of a bar or rod only the length of it counts, along the bar
  double moment_sigma = 0.0;             ///< A·m², a component (or along the bar): random magnetization, seeded
};

/// A body that beams hit, repeated on a lattice, with its steel. Every repetition draws its own random magnetization.
struct Solid {
  enum class Shape { group, rectangle, box, cylinder, tube };
  std::string name;
  Shape shape = Shape::group;
  Pose placement;                        ///< in the parent's frame
  std::array<int, 3> repeat_count{1, 1, 1};
  Vector3 repeat_step = Vector3::Zero();  ///< m, along the solid's own axes
  Vector3 size = Vector3::Zero();        ///< rectangle: x, y (it faces z); box: x, y, z. Centred at the placement
  double radius_m = 0.0;                 ///< cylinder and tube
  double height_m = 0.0;                 ///< cylinder, upwards from the placement
  double facet_m = 0.25;                 ///< longest facet of curved surfaces
  double tube_begin_m = 0.0;             ///< along the tube's axis; both ends are open
  double tube_end_m = 0.0;
  double tube_curvature_per_m = 0.0;     ///< of the axis, positive to the left; constant
  double tube_center_height_m = 0.0;     ///< of the round cross-section's centre above the flat floor
  std::vector<Steel> steel;
  std::vector<Solid> parts;              ///< of a group
};

struct LidarOptions {
  int rows = 32;
  int columns = 1024;
  double vertical_field_of_view_deg = 45.0;
  double rate_hz = 10.0;
  double first_scan_s = 0.05;
  double min_range_m = 0.5;
  double max_range_m = 100.0;
  double range_noise_m = 0.02;
  double max_incidence_deg = 88.0;       ///< a beam that grazes more than this does not come back
  double dropout_probability = 0.01;
  Pose T_imu_lidar;
};

struct ImuOptions {
  double rate_hz = 200.0;
  double height_m = 0.2;                 ///< above the floor
  double gyroscope_noise_rad_s_sqrt_hz = 1.0e-3;
  double accelerometer_noise_m_s2_sqrt_hz = 2.0e-2;
  double gyroscope_bias_walk_rad_s2_sqrt_hz = 2.0e-5;
  double accelerometer_bias_walk_m_s3_sqrt_hz = 2.0e-4;
  double gyroscope_bias_sigma_rad_s = 5.0e-3;      ///< of the bias at the start, a component
  double accelerometer_bias_sigma_m_s2 = 5.0e-2;
};

struct MagnetometerMount {
  std::string name;
  Pose T_imu_mag;
};

struct MagnetometerOptions {
  double rate_hz = 200.0;
  double offset_s = 1.3e-3;              ///< of the stamps against the IMU's; all magnetometers at one instant
  double noise_ut = 1.0;
  std::vector<MagnetometerMount> mounts;
};

/// How a floor shakes a robot. Slow parts have a correlation time; vibration is band-limited to about 15 Hz.
struct FloorOptions {
  double height_sigma_m = 1.0e-3;
  double tilt_sigma_deg = 0.25;          ///< roll and pitch
  double slip_yaw_sigma_deg = 0.6;       ///< of a skid-steer robot: heading against the path
  double slow_correlation_s = 0.5;
  double vibration_height_m = 5.0e-5;    ///< one sigma at full speed
  double vibration_tilt_deg = 0.015;
};

struct SurveyOptions {
  std::vector<double> lateral_offsets_m{-0.6, -0.2, 0.2, 0.6};  ///< left of the sequence's path; one lane each
  double speed_m_s = 1.8;
  double overrun_m = 1.5;                ///< past both ends of the path
  double position_sigma_m = 2.0e-3;      ///< white noise of the survey's trajectory, a component
  double angle_sigma_deg = 0.02;
};

struct SpeedPoint {
  double distance_m = 0.0;
  double speed_m_s = 1.0;
};

/// One drive. The path is the polyline through the way-points with rounded corners, smoothed.
struct Sequence {
  std::vector<Eigen::Vector2d> waypoints;  ///< map, metres
  double corner_radius_m = 2.0;            ///< at most; less where the legs are short
  std::vector<SpeedPoint> speed;           ///< linear between points
  double acceleration_m_s2 = 0.6;
  double max_yaw_rate_rad_s = 0.8;
  double rest_s = 2.0;                     ///< standing at the start, and half as long at the end
};

struct CloudOptions {
  double point_spacing_m = 0.09;
  double noise_m = 0.01;                 ///< one sigma a component
  double viewpoint_spacing_m = 3.0;      ///< the scanner stands along every sequence's path …
  double viewpoint_height_m = 1.5;       ///< … at the LiDAR's height and at this one
  double viewpoint_range_m = 125.0;
};

/// A world as its YAML file says. Nothing in the code knows a world by name.
struct World {
  std::string name;
  std::string file;
  std::uint64_t steel_seed = 1;
  std::int64_t start_time_ns = 1'700'000'000'000'000'000;
  double gravity_m_s2 = 9.80665;
  Vector3 earth_field_ut{18.0, -9.0, -40.0};  ///< map axes
  LidarOptions lidar;
  ImuOptions imu;
  MagnetometerOptions magnetometers;
  FloorOptions floor;
  CloudOptions cloud;
  SurveyOptions survey;
  std::vector<Solid> solids;
  std::map<std::string, Sequence> sequences;
};

/// Reads a world. `overrides` are "key.path=value" (a number indexes a list); each replaces or adds a key before the
/// world is read. Throws InputError with the file, the key and what to change; unknown keys are errors.
World load_world(const std::string& path, const std::vector<std::string>& overrides);

/// The sequence called `name`; the first where `name` is empty. Throws InputError that lists the names there are.
const std::pair<const std::string, Sequence>& find_sequence(const World& world, const std::string& name);

/// What an estimator may know of the world's sensors.
SensorSuite sensor_suite(const World& world);

/// Point (distance along the axis, left of it, above the floor) of a tube in the tube's frame.
Vector3 tube_point(const Solid& tube, const Vector3& local);

}  // namespace lodestone::simulation

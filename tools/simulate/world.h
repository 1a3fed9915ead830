#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/geometry/pose.h"
#include "core/options.h"
#include "core/sensor_suite.h"
#include "core/time.h"
#include "tools/simulate/faults.h"
#include "tools/simulate/reality_options.h"
#include "tools/simulate/sensor_options.h"

/// Worlds and the sensors that drive through them: the output of `lodestone simulate`, also as a MeasurementSource.
namespace lodestone::simulation {

enum class SteelKind {
  dipole,   ///< one dipole at region_min
  bar,      ///< one bar from region_min to region_max
  dipoles,  ///< scattered in the region
  rods,     ///< horizontal bars scattered in the region
  rings,    ///< hoops of bars round a tube, every spacing_m, at ring_radius_m about the tube's centre line
};

constexpr auto enum_names(SteelKind) {
  return EnumNames<SteelKind, 5>{{{SteelKind::dipole, "dipole"},
                                  {SteelKind::bar, "bar"},
                                  {SteelKind::dipoles, "dipoles"},
                                  {SteelKind::rods, "rods"},
                                  {SteelKind::rings, "rings"}}};
}

/// Steel of a solid, in the solid's own frame (tube: distance along the axis, left of the axis, above the floor).
struct Steel {
  SteelKind kind = SteelKind::dipole;
  Vector3 region_min = Vector3::Zero();      ///< m
  Vector3 region_max = Vector3::Zero();      ///< m
  double density_per_m2 = 0.0;               ///< of the region seen from above
  std::array<double, 2> length_m{1.0, 1.0};  ///< of rods, uniform in this range
  double angle_deg = 0.0;                    ///< of rods against the solid's x axis
  double angle_spread_deg = 90.0;            ///< of rods: uniform within ± this of angle_deg
  double spacing_m = 1.0;                    ///< of rings
  double ring_radius_m = 0.0;
  int ring_segments = 12;
  Vector3 moment = Vector3::Zero();  ///< A·m²; bars: only x, along the bar
  double moment_sigma = 0.0;         ///< A·m², per component (bars: along the bar): random magnetization, seeded
};

enum class SolidShape { group, rectangle, box, cylinder, tube };

constexpr auto enum_names(SolidShape) {
  return EnumNames<SolidShape, 5>{{{SolidShape::group, "group"},
                                   {SolidShape::rectangle, "rectangle"},
                                   {SolidShape::box, "box"},
                                   {SolidShape::cylinder, "cylinder"},
                                   {SolidShape::tube, "tube"}}};
}

/// A body that reflects beams, repeated on a lattice, with its steel. Every repetition draws its own magnetization.
struct Solid {
  std::string name;
  SolidShape shape = SolidShape::group;
  Pose placement;  ///< in the parent's frame
  std::array<int, 3> repeat_count{1, 1, 1};
  Vector3 repeat_step = Vector3::Zero();  ///< m, along the solid's own axes
  Vector3 size = Vector3::Zero();         ///< rectangle: x, y (normal z); box: x, y, z. Centred at the placement
  double radius_m = 0.0;                  ///< of a cylinder or tube
  double height_m = 0.0;                  ///< of a cylinder, upwards from the placement
  double facet_m = 0.25;                  ///< longest facet of curved surfaces
  double transparency = 0.0;              ///< of glass: share of beams that pass through each face
  double max_incidence_deg = 90.0;        ///< glass reflects beams away beyond this angle to its normal
  double tube_begin_m = 0.0;              ///< along the tube's axis; both ends are open
  double tube_end_m = 0.0;
  double tube_curvature_per_m = 0.0;  ///< of the axis, positive to the left; constant
  double tube_center_height_m = 0.0;  ///< of the round cross-section's centre above the flat floor
  std::vector<Steel> steel;
  std::vector<Solid> parts;  ///< of a group (a template placed here)
};

struct SpeedPoint {
  double distance_m = 0.0;
  double speed_m_s = 1.0;
};

/// Name for no scene: the permanent solids alone.
inline constexpr const char* no_scene = "none";

/// One drive. The path is the polyline through the way-points with rounded corners, smoothed.
struct Sequence {
  std::vector<Eigen::Vector2d> waypoints;         ///< map, metres
  std::vector<Eigen::Vector2d> survey_waypoints;  ///< the survey's lanes run along these; empty: along `waypoints`
  double corner_radius_m = 2.0;                   ///< upper limit; smaller where the legs are short
  std::vector<SpeedPoint> speed;                  ///< linear between points
  double acceleration_m_s2 = 0.6;
  double max_yaw_rate_rad_s = 0.8;
  double rest_s = 2.0;        ///< standing time at the start; half of it at the end
  std::string scene;          ///< scene of the drive unless the command names one; empty: the permanent solids alone
  std::vector<Fault> faults;  ///< the world's faults, then the sequence's
};

/// A world as read from its YAML file. No code depends on a world's name.
struct World {
  std::string name;
  std::string file;
  std::uint64_t steel_seed = 1;
  Time start_time = 0;  ///< stamp of the first IMU sample
  double gravity_m_s2 = 9.80665;
  Vector3 earth_field_ut = Vector3::Zero();  ///< map axes
  LidarOptions lidar;
  ImuOptions imu;
  MagnetometerOptions magnetometers;
  std::optional<WheelOptions> wheels;  ///< empty: no wheel odometry
  FloorOptions floor;
  CloudOptions cloud;
  SurveyOptions survey;
  RealityOptions reality;
  std::vector<Solid> solids;
  std::map<std::string, std::vector<Solid>> scenes;  ///< stand beside `solids` in this scene: a day's parked cars
  std::map<std::string, Sequence> sequences;
};

/// Reads a world. `assignments` are "key.path=value"; they replace or add keys before the world is read. Throws
/// InputError with file, line, key and correction; unknown keys are errors.
World load_world(const std::string& path, const std::vector<std::string>& assignments = {});

/// The sequence called `name`; the first if `name` is empty. Throws InputError that lists the known names.
const std::pair<const std::string, Sequence>& find_sequence(const World& world, const std::string& name);

/// The additional solids of the scene called `name`; none if empty. Throws InputError that lists the scenes.
const std::vector<Solid>& find_scene(const World& world, const std::string& name);

/// The world's sensors as an estimator may know them, with the true noise and the calibration sigmas of the reality.
SensorSuite sensor_suite(const World& world);

/// A point (distance along the axis, left of the axis, above the floor) of a tube, in the tube's frame.
Vector3 tube_point(const Solid& tube, const Vector3& local);

}  // namespace lodestone::simulation

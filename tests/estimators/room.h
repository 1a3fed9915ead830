#pragma once

#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "core/geometry/trajectory.h"
#include "core/lidar/plane_map.h"
#include "core/magnetometer/magnetic_map.h"
#include "estimators/factory.h"
#include "frontends/synchronizer/synchronizer.h"
#include "tools/simulate/cloud_map.h"
#include "tools/simulate/simulation_source.h"

namespace lodestone::testing {

/// Empty except for four equal pillars: after half a turn the room looks the same, but the steel in its floor differs.
inline constexpr const char* kRoom = R"(
name: room
steel_seed: 3
earth_field_ut: [20, 0, -40]
sensors:
  lidar: {rows: 16, columns: 512}
  magnetometer_mounts:
    - {position_m: [0.3, 0.25, -0.08]}
    - {position_m: [0.3, -0.25, -0.08]}
    - {position_m: [-0.3, 0.25, -0.08]}
    - {position_m: [-0.3, -0.25, -0.08]}
solids:
  - {name: floor, shape: rectangle, size_m: [16, 10], steel: [{kind: rods, from_m: [-8, -5, -0.6], to_m: [8, 5, -0.4],
     density_per_m2: 1.5, length_m: [0.5, 1.5], moment_sigma_a_m2: 45}]}
  - {name: room, shape: box, at_m: [0, 0, 2], size_m: [16, 10, 4]}
  - {name: pillars, shape: box, at_m: [-4, -2, 2], size_m: [0.6, 0.6, 4], repeat: {count: [2, 2, 1], step_m: [8, 4, 0]}}
cloud: {point_spacing_m: 0.08}
sequences:
  loop: {waypoints_m: [[-6, -3.5], [6, -3.5], [6, 3.5], [-6, 3.5]], speed: [[0, 1.0]]}
)";

inline std::shared_ptr<const MagneticMap> field_over(const simulation::World& world,
                                                     const simulation::Environment& environment,
                                                     const Eigen::Vector2d& low, const Eigen::Vector2d& high) {
  FieldGrid grid;
  grid.resolution_m = 0.15;
  grid.origin = low;
  grid.columns = static_cast<int>((high.x() - low.x()) / grid.resolution_m) + 1;
  grid.rows = static_cast<int>((high.y() - low.y()) / grid.resolution_m) + 1;
  grid.heights_m = {world.imu.height_m + world.magnetometers.mounts.front().T_imu_mag().position.z()};
  std::vector<Eigen::Vector4f> nodes;
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      const Vector3 field = environment.field.field_ut(
          Vector3(low.x() + grid.resolution_m * column, low.y() + grid.resolution_m * row, grid.heights_m.front()));
      nodes.emplace_back(field.x(), field.y(), field.z(), 0.3F);
    }
  }
  return std::make_shared<MagneticMap>(grid, nodes, 3.0);
}

/// The room with its maps.
struct Room {
  simulation::World world;
  std::shared_ptr<const simulation::Environment> environment;
  std::vector<Eigen::Vector3f> cloud;
  EstimatorInput input;  ///< without an initial pose
};

inline Room load_room() {
  const auto file = std::filesystem::temp_directory_path() / ("lodestone-room-" + std::to_string(::getpid()) + ".yaml");
  std::ofstream(file) << kRoom;
  Room room{simulation::load_world(file.string()), nullptr, {}, {}};
  std::filesystem::remove(file);
  room.environment = std::make_shared<const simulation::Environment>(room.world);
  room.cloud = sample_cloud(room.world, *room.environment, 1);
  room.input.suite = simulation::sensor_suite(room.world);
  room.input.planes = std::make_shared<PlaneMap>(room.cloud, PlaneMapOptions{});
  room.input.field = field_over(room.world, *room.environment, {-8.0, -5.0}, {8.0, 5.0});
  return room;
}

/// A drive along the room's loop.
struct RoomDrive {
  Room room;  ///< with the drive's initial pose
  Trajectory truth;
  std::vector<ScanBundle> bundles;
};

inline RoomDrive drive_through_room(std::uint64_t seed, double duration_s) {
  RoomDrive drive{load_room(), {}, {}};
  simulation::SimulationSource source(drive.room.world, drive.room.environment, "loop",
                                      simulation::SimulationSource::Drive::sequence, seed, duration_s);
  drive.truth = source.trajectory();
  WarningLog warnings;
  Synchronizer synchronizer(source, drive.room.input.suite, warnings);
  for (ScanBundle bundle; synchronizer.next(bundle);) drive.bundles.push_back(bundle);
  const Time begin = std::max(drive.bundles.front().scan.start, drive.truth.front().time);
  drive.room.input.initial_pose = *interpolate(drive.truth, begin, 1'000'000'000);
  return drive;
}

}  // namespace lodestone::testing

#pragma once

#include <fmt/format.h>

#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "frontends/configuration/platform.h"
#include "frontends/configuration/trajectory_file.h"
#include "frontends/maps/magnetic_map_file.h"
#include "frontends/maps/point_cloud_writer.h"
#include "tests/estimators/drive.h"
#include "tests/tools/program_runner.h"
#include "tools/check/check_call.h"
#include "tools/simulate/bag_recorder.h"

namespace lodestone {

/// A hall with a rack and steel in its floor; a robot that stands, drives straight, and turns a corner. Logs, maps and
/// platform files are in a folder; the field map is the true field at its nodes.
class CheckSite {
 public:
  static constexpr double duration_s = 8.0;
  static constexpr std::uint64_t seed = 5;

  CheckSite() {
    std::ofstream(file("hall.yaml")) << world_text;
    const simulation::World world = simulation::load_world(file("hall.yaml"), {});
    environment_ = std::make_shared<const simulation::Environment>(world);
    cloud_ = simulation::sample_cloud(world, *environment_, seed);
    write_point_cloud(file("cloud.pcd"), cloud_);
    simulation::SimulationSource drive(world, environment_, "a", simulation::SimulationSource::Drive::sequence, seed,
                                       duration_s);
    const Trajectory truth = drive.trajectory();
    write_tum(file("truth.tum"), truth);
    platform_.name = "hall";
    platform_.suite = simulation::sensor_suite(world);
    platform_.lidar = simulation::message_layout(simulation::scan_format(world.lidar));
    for (std::size_t j = 0; j < platform_.suite.magnetometers.size(); ++j) {
      platform_.magnetometers.push_back({fmt::format("/magnetometer_{}/field", j), FieldUnit::tesla});
    }
    save_platform(platform_, file("platform.yaml"));
    const double height_m = truth.front().pose.position.z() + platform_.suite.magnetometers[0].T_imu_mag.position.z();
    write_magnetic_map(*testing::true_field(*environment_, truth, height_m), {}, file("field.yaml"));
  }

  std::string file(const std::string& name) const { return (folder_ / name).string(); }
  const Platform& platform() const { return platform_; }
  const std::vector<Eigen::Vector3f>& cloud() const { return cloud_; }

  /// The log of a drive with these faults (YAML of a world); made once.
  std::string log(const std::string& faults) {
    const auto [found, is_new] = logs_.try_emplace(faults, file(fmt::format("log{}.bag", logs_.size())));
    if (!is_new) return found->second;
    const simulation::World world = simulation::load_world(file("hall.yaml"), {"faults=[" + faults + "]"});
    simulation::SimulationSource drive(world, environment_, "a", simulation::SimulationSource::Drive::sequence, seed,
                                       duration_s);
    simulation::BagRecorder::Topics topics{platform_.lidar.topic, platform_.imu.topic, {}};
    for (const auto& magnetometer : platform_.magnetometers) topics.magnetometers.push_back(magnetometer.topic);
    simulation::BagRecorder recorder(found->second, topics, simulation::scan_format(world.lidar));
    for (Measurement measurement; drive.next(measurement);) recorder.write(measurement);
    recorder.close();
    return found->second;
  }

  /// No mistakes: log without faults, platform, both maps, initial pose from the ground truth.
  CheckCall call(const std::string& faults = "") {
    CheckCall call;
    call.log = log(faults);
    call.platform = file("platform.yaml");
    call.cloud = file("cloud.pcd");
    call.magnetic = file("field.yaml");
    call.initial_pose_from = file("truth.tum");
    return call;
  }

  /// The same with an edited platform file.
  CheckCall call_with(const std::function<void(Platform&)>& edit) {
    Platform edited = platform_;
    edit(edited);
    CheckCall result = call();
    result.platform = file(fmt::format("edited{}.yaml", ++edits_));
    save_platform(edited, result.platform);
    return result;
  }

 private:
  static constexpr const char* world_text = R"(
name: hall
earth_field_ut: [20, 0, -40]
sensors:
  lidar: {rows: 16, columns: 256, position_m: [0.05, 0, 0.3], rotation_rpy_deg: [0.3, -0.4, 1.0]}
  magnetometer_mounts:
    - {name: front_0, position_m: [0.3, 0.25, -0.08]}
    - {name: front_1, position_m: [0.3, 0.08, -0.08]}
    - {name: front_2, position_m: [0.3, -0.08, -0.08]}
    - {name: front_3, position_m: [0.3, -0.25, -0.08]}
    - {name: rear_0, position_m: [-0.3, 0.25, -0.08], rotation_rpy_deg: [0, 0, 180]}
    - {name: rear_1, position_m: [-0.3, 0.08, -0.08], rotation_rpy_deg: [0, 0, 180]}
    - {name: rear_2, position_m: [-0.3, -0.08, -0.08], rotation_rpy_deg: [0, 0, 180]}
    - {name: rear_3, position_m: [-0.3, -0.25, -0.08], rotation_rpy_deg: [0, 0, 180]}
solids:
  - {name: floor, shape: rectangle, size_m: [16, 12], steel: [{kind: rods, from_m: [-8, -6, -0.5], to_m: [8, 6, -0.4],
     density_per_m2: 1, length_m: [0.5, 1.0], moment_sigma_a_m2: 10}]}
  - {name: walls, shape: box, at_m: [0, 0, 2], size_m: [16, 12, 4]}
  - {name: rack, shape: box, at_m: [-2, 2.5, 0.8], size_m: [3, 1.2, 1.6]}
  - {name: crate, shape: box, at_m: [6, -4, 0.6], size_m: [1, 1.5, 1.2]}
sequences:
  a: {waypoints_m: [[-4, -3], [1, -3], [1, 4]], speed: [[0, 1.5]]}
)";

  TemporaryFolder folder_;
  Platform platform_;
  std::shared_ptr<const simulation::Environment> environment_;
  std::vector<Eigen::Vector3f> cloud_;
  std::map<std::string, std::string> logs_;
  int edits_ = 0;
};

/// Shared by all tests of a process.
inline CheckSite& site() {
  static CheckSite the_site;
  return the_site;
}

}  // namespace lodestone
